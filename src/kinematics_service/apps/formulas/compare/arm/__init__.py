"""
Compute the quantities that formulas name (poses, axes, Jacobians), in symbols and in numbers.
"""
