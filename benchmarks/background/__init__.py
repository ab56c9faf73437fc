"""How well the background of a clip and the smoke before it are found, and what that costs the volume.

- ``cases``: clips of baked smoke before known backgrounds
- ``colors``: whether the smoke's own color is found
"""
