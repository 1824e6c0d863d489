"""Joint paths of a redundant arm through sequences of targets."""
