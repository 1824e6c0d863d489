"""Apps beside each other on the core; each folder is one, and can be removed."""
