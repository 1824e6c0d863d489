"""Closed loops: compute passive variables and their rates from the joint positions and rates."""
