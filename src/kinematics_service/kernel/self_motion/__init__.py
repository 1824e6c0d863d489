"""Curves of inverse kinematics solutions, if an arm has one joint more than its target needs."""
