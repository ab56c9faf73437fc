#!/usr/bin/env bash
# window.sh STORY PICTURES BLEND FIRST LAST LONGEST_SIDE    in the root: a story of an artist, in a Blender with a
# window, on a screen without a monitor, drawn in software; on a shot that is made there first.
set -euo pipefail
here=$(dirname "$0")
blender -b --python-exit-code 1 --python "$here/make_shot.py" -- "${@:3}"
export LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe XDG_RUNTIME_DIR=/tmp/xdg
mkdir -p -m 700 "$XDG_RUNTIME_DIR"
exec timeout 400 xvfb-run -a -s "-screen 0 1600x1000x24 -dpi 96 +extension GLX -noreset" \
    blender --window-geometry 0 0 1600 1000 "$3" --python "$here/$1" -- "$2"
