"""Clips of every kind that a camera, a phone, a renderer or an accident makes, against the command line.

- ``film``: the pictures that are encoded, and ways to encode them
- ``kinds``: the files, each with what is known of it
- ``judge``: whether a file is read as what was encoded, and how the command ended

``python -m benchmarks.file_kinds FOLDER`` makes all files, reconstructs each, and prints a table.
"""
