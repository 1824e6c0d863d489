"""Kinematics on screen: pictures in files, and a live page."""
