"""The renderer: image and gradient beside other ways to do the same work, and beside exact answers.

- ``scene``: what everybody renders; ``reference``: its exact image and gradient; ``sampling``: tables for the peers
- ``peers``: one module a competitor, and one for Smokelift; ``worker`` runs one of them in a process of its own
- ``__main__`` runs and compares them all
- ``stability``, ``agreement`` (with ``mitsuba_pictures``), ``paper_derivative``: commands that write the tables
  of the documentation
"""
