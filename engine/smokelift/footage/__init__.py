"""Footage: pictures in linear light, and the smoke in them apart from its background.

``clip`` gives the frames of a ``video`` or an ``image_sequence`` (each a ``frame_source``); ``kept_frames`` has the
last ones of a file. ``images`` reads and resizes single pictures; ``colour`` knows how files encode light, ``lens`` the
focal length that they give, ``layer`` what an alpha channel means, and ``cut`` where a clip is cut.

``plate`` is what is behind the smoke: ``background`` reads the one that a scene gives, ``plate_estimation`` finds one
in the clip. It asks ``backdrop`` for one of one colour; else ``clear_values`` tells which values of a pixel are clear
of smoke, and ``behind_smoke`` continues what never is. ``noise`` measures the clip's noise, and ``matte`` finds the
smoke, which differs from the plate by more. ``working_picture`` cuts out the small picture that a grid is fitted to.
"""
