"""Footage: pictures in linear light, and the smoke in them apart from its background.

``clip`` gives the frames of a ``video`` or an ``image_sequence`` (each a ``frame_source``), less what a ``mask``
hides. ``images`` reads and resizes single pictures; ``colour`` knows how files encode light.

``proxy`` is the file in small, up to the cuts. ``backdrop`` decides on it what stands behind the smoke: what
``given_background`` reads, or what ``background_kind`` ranks first, one colour or a picture. ``clear_picture`` finds
the frames that show a picture clear of smoke, unless its camera moves (``camera_motion``), and makes it of full size;
what none shows is `behind_smoke`. ``noise`` measures the clip's noise, and ``matte`` finds the
smoke, which differs from the ``plate`` by more. ``working_picture`` cuts out the small picture that a grid is fitted
to.
"""
