"""What follows from joint positions: pose, Jacobian, twist, singularity."""
