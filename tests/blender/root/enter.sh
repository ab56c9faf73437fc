#!/usr/bin/env bash
# enter.sh ROOT FOLDER COMMAND...    run a command in the Debian root, with FOLDER at its own path and without a network.
# In mount, process and network namespaces of its own: nothing stays mounted or running afterwards.
exec unshare --mount --propagation private --pid --fork --kill-child --net bash -c '
    set -e
    root=$1 folder=$2
    shift 2
    mkdir -p "$root$folder"
    mount -t proc proc "$root/proc"
    mount --rbind /dev "$root/dev"
    mount --rbind /sys "$root/sys"
    mount -t tmpfs tmpfs "$root/dev/shm"
    mount -t tmpfs tmpfs "$root/home"
    mount --bind "$folder" "$root$folder"
    cd /
    exec env -i PATH=/usr/bin:/bin:/usr/sbin:/sbin HOME=/root LANG=C.UTF-8 TERM=dumb chroot "$root" "$@"
' _ "$(realpath "$1")" "$(realpath "$2")" "${@:3}"
