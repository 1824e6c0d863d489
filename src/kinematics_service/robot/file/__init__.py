"""Read, check and write robot files."""
