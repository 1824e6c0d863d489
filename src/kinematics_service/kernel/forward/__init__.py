"""Forward kinematics: compute frames, screws and twist of one pose, or of 16 poses at once."""
