#!/bin/sh
# Bake and render examples/plume again. PYTHON has mitsuba, av, numpy and scipy; BLENDER is 3.4 with Mantaflow.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
out=${1:?usage: generate.sh DIR, a folder for the truth and the reference images}
mkdir -p "$out"
"${BLENDER:-blender}" -b --factory-startup -P "$here/bake.py" -- "$out/truth.npz"
PYTHONPATH="$here/../.." "${PYTHON:-python3}" -m benchmarks.example.render "$out/truth.npz" "$here/../../examples/plume/scene.toml" \
    --views "$out" --check 12 30 46
cp "$here"/../../examples/plume/* "$out"
