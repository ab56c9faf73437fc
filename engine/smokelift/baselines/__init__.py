"""The paper's own method, part by part, for comparison.

``paper_method`` has its density, depth prior and velocity; ``paper_renderer`` has its picture and derivative as
formulas, and ``paper_kernels`` their loops.
"""
