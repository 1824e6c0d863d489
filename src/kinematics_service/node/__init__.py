"""Run the ROS 2 node: its topics, its parameters, its process, and the picture of its arm."""
