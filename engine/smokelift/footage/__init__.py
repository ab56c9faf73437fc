"""Footage: pictures in linear light, and the smoke in them apart from its background.

``clip`` gives the frames of a ``video`` or an ``image_sequence`` (each a ``frame_source``), less what a ``mask``
hides. ``images`` reads and resizes single pictures; ``color`` knows how files encode light.

``backdrop`` decides on a small copy of the file (``proxy``) what stands behind the smoke: what ``given_background``
reads, or one color or a picture, as ``background_kind`` ranks them. ``clear_picture`` makes the picture from frames
that show it clear, and ``inpainting`` continues it where none does. If the camera moves (``camera_motion``), frames
are moved onto a reference by ``registration``.
``noise`` measures the clip's noise. ``matte`` finds the smoke: it differs from the ``plate`` by more than noise.
``working_picture`` cuts out the small picture that a grid is fitted to.
"""
