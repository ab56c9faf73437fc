"""The velocity estimate: error against time, and error on known flows.

- ``pairs``: two densities and the motion between them; ``flow`` makes them from a formula
- ``run`` measures whole estimates; ``table`` shows the result
- ``accuracy``: estimates on baked scenes; ``poisson``: a Poisson solve beside SciPy's
"""
