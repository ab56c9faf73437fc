"""How near a result is to the truth: metrics and scores.

``evaluate`` compares a sequence with known volumes, which ``truth`` reads, and with other cameras' clips, by the errors
in ``metrics``. ``orbit`` looks at its smoke from all around, also without a truth, by the patches and shapes of
``statistics``.
"""
