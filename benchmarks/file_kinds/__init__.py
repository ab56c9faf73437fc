"""Clips of every kind that a camera, a phone, a renderer or an accident makes, read and compared.

- ``film``: the pictures that are encoded, and ways to encode them
- ``kinds``: the files, each with what is known of it
- ``judge``: whether a file is read as what was encoded

``tests/benchmarks/test_file_kinds.py`` reads some of them.
"""
