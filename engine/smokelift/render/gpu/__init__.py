"""The renderer on a GPU: ``backend`` runs ``light_kernels`` and ``camera_kernels`` by Taichi.

Nothing here is imported before a GPU is found: importing Taichi takes longer than a picture.
"""
