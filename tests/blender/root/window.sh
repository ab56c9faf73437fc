#!/usr/bin/env bash
# window.sh ARGUMENTS...    in the root: Blender with a window, on a screen without a monitor, drawn in software.
export LIBGL_ALWAYS_SOFTWARE=1 GALLIUM_DRIVER=llvmpipe XDG_RUNTIME_DIR=/tmp/xdg
mkdir -p -m 700 "$XDG_RUNTIME_DIR"
exec timeout 300 xvfb-run -a -s "-screen 0 1600x1000x24 -dpi 96 +extension GLX -noreset" \
    blender --window-geometry 0 0 1600 1000 "$@"
