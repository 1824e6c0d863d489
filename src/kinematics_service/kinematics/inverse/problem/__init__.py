"""
Prepare an inverse kinematics problem: choose the solution method from the geometry of the arm, and
check the target.
"""
