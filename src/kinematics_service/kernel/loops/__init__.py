"""
Closed loops: compute the passive variables and their rates from the joint positions and
velocities.
"""
