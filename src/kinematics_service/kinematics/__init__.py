"""Compute pose, Jacobian, twist, singularity and inverse kinematics of an arm."""
