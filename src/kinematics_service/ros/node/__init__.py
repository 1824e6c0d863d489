"""The node: joint states in, answers out."""
