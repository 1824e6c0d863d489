"""The ROS 2 node: topics, parameters, process; and what is drawn of its arm."""
