"""Accuracy against the strength of each disturbance, of the default and of the paper's method.

- ``known``: smoke whose flow and whose pictures from four sides are known, on a small grid
- ``spoiled``: what a camera, a codec and a wrong description do to a take of it
- ``smoke``: other smoke: thicker, darker, forward scattering, entering, splitting
- ``table``: every disturbance with its strengths
- ``whole_run``: reconstructs a take and scores it
- ``calls``: single calls of the fit and of the velocity
- ``report``: the CSV, the charts, the table of the page

``python -m benchmarks.disturbances OUT SCENE ...`` measures what OUT/stability.csv does not hold yet.
"""
