"""
Compute the clearance of joint positions: a proved radius, rad, within which no pose is singular.
"""
