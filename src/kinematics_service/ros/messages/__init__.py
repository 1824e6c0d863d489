"""The messages the node hears and speaks, and how they are made."""
