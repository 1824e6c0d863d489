"""Paths of targets of a redundant arm: which posture follows them, or the proof that none does."""
