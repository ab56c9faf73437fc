#!/usr/bin/env bash
# make.sh ROOT    a Debian root with a real Blender (4.3.2, Python 3.13), a screen without a monitor, and tools to look
# at it. Needs root and mmdebstrap; about a minute and 1.2 GB. The folder appears whole or not at all.
set -euo pipefail
root=${1:?a folder for the root}
packages=(
    ca-certificates blender python3-numpy python3-openvdb python3-pytest  # numpy is no dependency of Debian's blender
    xvfb xauth x11-utils x11-apps xdotool imagemagick                     # xwd takes pictures, xdotool clicks
    libgl1-mesa-dri libglx-mesa0 libegl-mesa0 libegl1 libgl1              # OpenGL in software
)
rm -rf --one-file-system "$root.part"
mkdir -p "$(dirname "$root")"
mmdebstrap --variant=minbase --mode=root \
    --aptopt='Acquire::Languages "none"' \
    --aptopt='Acquire::Check-Valid-Until "false"' \
    --aptopt='Acquire::Retries "3"' \
    --dpkgopt='path-exclude=/usr/share/man/*' \
    --dpkgopt='path-exclude=/usr/share/doc/*' \
    --dpkgopt='path-include=/usr/share/doc/*/copyright' \
    --dpkgopt='path-exclude=/usr/share/locale/*' \
    --include="$(IFS=,; echo "${packages[*]}")" \
    --customize-hook='ln -sf /proc/self/mounts "$1/etc/mtab"' \
    trixie "$root.part"
rm -rf --one-file-system "$root"
mv "$root.part" "$root"
