"""
Compute curves of inverse kinematics solutions of an arm with one joint more than its target needs.
"""
