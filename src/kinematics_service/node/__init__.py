"""Run the ROS 2 node: topics, parameters, process, and the picture of the arm."""
