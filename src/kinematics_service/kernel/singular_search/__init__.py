"""Find the singular pose nearest to a given pose."""
