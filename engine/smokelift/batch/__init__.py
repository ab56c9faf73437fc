"""Many shots: a list of clips, each reconstructed by a process of its own, on one machine or on many.

What is finished is on the storage and nowhere else, so every part of a batch may be ended and started again. ``shots``
has the list and what is known of each, ``work`` does one shot, or many on one machine, ``cluster`` many on several.
"""
