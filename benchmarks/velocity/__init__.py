"""The velocity estimate: error against time, and error on known flows.

- ``pairs``: two densities and the motion between them; ``flow`` makes them from a formula
- ``linear``: one linear problem that both solvers solve
- ``run`` measures both; ``table`` and ``chart`` show the result
- ``accuracy``, ``transport``: commands that measure estimates and transport on baked scenes
"""
