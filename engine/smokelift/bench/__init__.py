"""Benchmarks: the renderer beside other ways to do the same work on the same machine, and the velocity.

``scene`` is what everybody renders, ``reference`` the right answer in float64, ``peers`` one module a competitor (and
one for us), ``worker`` runs one of them in a process of its own, ``renderer`` runs them all and compares, ``table`` and
``chart`` show what came out. ``velocity`` is a package of its own; ``machine`` says for both what they ran on.
"""
