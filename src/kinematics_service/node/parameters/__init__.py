"""Read the node's parameters, and make its settings from them."""
