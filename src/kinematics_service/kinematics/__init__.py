"""Pose, Jacobian, twist, singularity and inverse of an arm, as functions of joint positions."""
