"""Prepare an inverse kinematics problem: find properties of the arm, and check the target."""
