"""Prepare a problem of inverse kinematics: properties of the arm, and the checked target."""
