"""Find the singular pose nearest to given joint positions."""
