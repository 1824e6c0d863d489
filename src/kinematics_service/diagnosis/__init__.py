"""What a recording says of the arm, and of the robot file."""
