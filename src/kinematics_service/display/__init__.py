"""Kinematics to be looked at: pictures in files, and a page that moves."""
