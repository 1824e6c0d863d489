"""
Derive frames, Jacobian, determinant and singular set of an arm exactly, with sympy.
"""
