"""Frames, screws and the twist from joint variables: of one pose, or of 16 side by side."""
