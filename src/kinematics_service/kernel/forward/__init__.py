"""From joint variables to frames, screws and the twist: one pose, or sixteen side by side."""
