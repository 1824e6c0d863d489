"""The node's parameters, and the settings they make."""
