#!/usr/bin/env bash
# make_root.sh ROOT    a Debian bookworm root with Blender 3.4.1, the Debian Blender whose Mantaflow runs headless
# (those of trixie and of the bpy wheels do not bake). Needs root and mmdebstrap; about a minute and 1 GB. The folder
# appears whole or not at all.
set -euo pipefail
root=${1:?a folder for the root}
packages=(ca-certificates blender python3-numpy) # numpy is no dependency of Debian's blender
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
    bookworm "$root.part"
rm -rf --one-file-system "$root"
mv "$root.part" "$root"
