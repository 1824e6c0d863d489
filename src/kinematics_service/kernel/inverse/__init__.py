"""
Inverse kinematics: compute joint positions for a target pose, and joint velocities for a twist.
"""
