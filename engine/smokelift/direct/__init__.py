"""Smoke after its clip: continued, retimed, looped, and made to react to wind, turbulence, fans and obstacles.

``continuation`` goes on after a sequence, in a box that grows with the smoke, by a ``simulation`` that ``fitting`` fits
to its last frames. ``surroundings`` are what an artist adds, with obstacles of any shape by ``mesh``. ``retiming``
makes another speed, or a loop. ``state`` reads, interpolates and writes frames, for all of them.
"""
