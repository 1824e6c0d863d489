"""Inverse kinematics: all joint positions that bring the tool to a target, each of them proved."""
