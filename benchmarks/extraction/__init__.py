"""How well smoke is separated from what stands behind it: baked smoke before plates, beside its true element.

An element is what a camera sees of the smoke alone: its radiance S and its transmittance T. Before a plate B the
picture is S + T B.
"""
