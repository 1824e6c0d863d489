"""A problem of inverse kinematics: what is known of the arm and the target before it is solved."""
