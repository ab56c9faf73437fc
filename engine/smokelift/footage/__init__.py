"""Footage: files to frames in linear light.

``clip`` gives the frames of a ``video`` or of numbered pictures (each a ``frame_source``), less what a ``mask`` hides,
moved onto a reference by ``registration`` if the camera moves. ``image_files`` reads single pictures, ``images``
resizes them and continues what they do not show, and ``noise`` measures frames.
"""
