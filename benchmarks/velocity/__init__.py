"""The velocity estimate: error against time, and error on known flows.

- ``__main__``: whole estimates by solver; on ``pairs`` of baked scenes, or those that ``flow`` makes from a formula
- ``accuracy``: estimates on baked scenes; ``slices`` draws them
"""
