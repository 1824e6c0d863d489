"""Make the picture of an arm as plain data, for ROS markers and the page of command `view`."""
