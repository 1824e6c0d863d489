"""Compute all inverse kinematics solutions of a general arm of six joints, by elimination."""
