"""Solve inverse kinematics: find and prove all joint positions that bring the tool to a target."""
