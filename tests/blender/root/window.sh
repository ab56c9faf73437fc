#!/usr/bin/env bash
# window.sh PICTURES FIRST LAST LONGEST_SIDE    in the root: drive_panel.py in a Blender with a window, on a screen
# without a monitor, drawn in software. The shot lies where an artist's would; the folder goes with the command.
set -euo pipefail
here=$(dirname "$0")
shot=/home/artist/plume/shot.blend
mkdir -p /home/artist
blender -b --python-exit-code 1 --python "$here/make_shot.py" -- "$shot" "${@:2}"
export LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe XDG_RUNTIME_DIR=/tmp/xdg
mkdir -p -m 700 "$XDG_RUNTIME_DIR"
exec timeout 400 xvfb-run -a -s "-screen 0 1600x1000x24 -dpi 96 +extension GLX -noreset" \
    blender --window-geometry 0 0 1600 1000 "$shot" --python "$here/drive_panel.py" -- "$1"
