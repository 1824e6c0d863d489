"""Turn a file of formulas into statements about a robot, and check each statement."""
