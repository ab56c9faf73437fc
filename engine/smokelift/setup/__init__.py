"""Set-up of a shot from a description and its footage: geometry, light, medium, and no more model than needed.

``prepare`` makes a ``shot`` of a clip, a scene and ``settings``, in this order: ``first_estimate`` finds background,
smoke and fire, ``geometry`` camera, box and voxels, ``illumination`` medium, light and scattering, which ``coarse``
judges on a few small frames, and ``further_views`` opens the clips of other cameras.
"""
