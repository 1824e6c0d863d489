"""Define the commands `plot` and `view` with their options, a file each."""
