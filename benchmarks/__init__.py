"""Measurements of Smokelift. They live in the source only and are part of no wheel.

- ``renderer``: the renderer beside other ways to do the same work, and beside exact answers
- ``velocity``: error against time of the velocity solver, and its error on known flows
- ``pipeline``: seconds a frame and memory of whole runs
- ``accuracy``: reconstructions beside known volumes and other views
- ``stability``: damaged files, hostile values and failing systems against the command line
- ``clean_clip``, ``disturbances``: what a camera, a codec or a wrong description costs
- ``background``: backgrounds that are found beside known ones
- ``extraction``: smoke separated from known plates, and what is reconstructed of it
- ``direct``: smoke that is continued beside what came
- ``file_kinds``: clips of every kind of file; ``tests/benchmarks/test_file_kinds.py`` reads some
- ``blender``: pictures for the manual, and results beside their clips in Cycles
- ``truth``: makes the scenes that are known, and the example clip

``python -m benchmarks renderer|velocity|pipeline`` runs the first three; the other commands are
modules of their own, such as ``python -m benchmarks.accuracy``. All run in the folder of the checkout.
"""
