"""Inverse kinematics: joint positions for a target, and joint velocities for a twist."""
