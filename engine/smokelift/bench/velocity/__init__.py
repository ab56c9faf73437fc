"""The velocity estimate: what more or less time buys, in Poisson solves of the same grid.

``pairs`` are two densities and the motion between them, baked or from ``flow``, which needs nothing but a formula;
``linear`` is the problem that both solvers solve; ``run`` measures; ``table`` and ``chart`` show.
"""
