"""The ROS 2 node: its topics, parameters and process, and the picture of its arm."""
