"""Findings about the arm and the robot file from recordings."""
