"""The motions of the simulated arm: through a singular pose, and sines; ROS is not needed."""
