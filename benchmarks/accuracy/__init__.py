"""Reconstructions beside known volumes and other views.

``python -m benchmarks.accuracy`` reconstructs scenes, each run in a process of its own (``worker``), and scores them.
``chart`` draws speed against accuracy.
"""
