"""Compute the motions of the simulated arm: through a singular pose, and sines, without ROS."""
