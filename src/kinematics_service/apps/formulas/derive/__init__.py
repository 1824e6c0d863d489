"""
Exact derivations: frames, Jacobian, determinant, singular set; the only place that knows sympy.
"""
