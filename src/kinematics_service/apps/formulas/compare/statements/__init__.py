"""What the formulas of a file say about a robot, and whether it is true."""
