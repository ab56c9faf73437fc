"""Extraction: smoke apart from what is behind it, I = S + T B + n; before anything is fitted.

``find_background`` decides on a small copy of the file (``proxy``) what stands behind the smoke: what
``given_background`` reads, or the likelier of one color and a picture, which ``clean_plate`` makes from frames that
show it clear. ``camera_motion`` finds how the camera moves. The result is the ``plate``, and where smoke always covers
it ``hidden_plate`` finds the likeliest one. ``matte`` finds the smoke, which differs from the plate by more than noise,
and fire. ``element`` is the smoke of a frame, S and T, without its plate.
"""
