"""
Solve inverse kinematics: find all joint positions that bring the tool to a target, and prove that
none is missing.
"""
