"""Forward kinematics: frames, screws and twist, of one pose or of 16 poses side by side."""
