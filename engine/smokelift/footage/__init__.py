"""Footage: files to frames in linear light.

``clip`` gives the frames of a ``video`` or an ``image_sequence`` (each a ``frame_source``), less what a ``mask``
hides, moved onto a reference by ``registration`` if the camera moves. ``images`` reads and resizes single pictures;
``color`` knows how files encode light and alpha. ``noise`` and ``exposure`` measure frames, and ``inpainting``
continues what they do not show.
"""
