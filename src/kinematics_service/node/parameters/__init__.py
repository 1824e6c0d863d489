"""Read the parameters of a node, and compute the node's settings from their values."""
