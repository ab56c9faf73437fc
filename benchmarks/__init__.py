"""Measurements of Smokelift. They live in the source only and are part of no wheel.

Shared by all:

- ``baked``: the scenes that ``truth`` bakes; ``plates``: what stands behind their smoke
- ``filming``: what a camera, a codec and an editor do to pictures
- ``measure``: reconstructs a clip and compares it with what is known; ``tables`` prints and keeps rows
- ``machine``, ``process``: the machine, its time, and processes of their own

Each is run as ``python -m benchmarks.NAME`` in the folder of the checkout:

- ``accuracy``: reconstructions beside known volumes and other views
- ``background``: backgrounds that are found beside known ones, and what a spoiled clip costs its volume
- ``disturbances``: accuracy against the strength of each disturbance
- ``extraction``: smoke separated from known plates, and what is reconstructed of it
- ``pipeline``: seconds per frame and memory of whole runs
- ``renderer``: the renderer beside other ways to do the same work, and beside exact answers
- ``stability``: damaged files, hostile values and failing systems against the command line
- ``velocity``: error against time of the velocity solver, and its error on known flows

Modules of others are run by their own names: ``direct`` (smoke that is continued beside what came), ``blender``
(pictures for the manual, and results beside their clips in Cycles), ``truth`` (makes the known scenes and the example).
"""
