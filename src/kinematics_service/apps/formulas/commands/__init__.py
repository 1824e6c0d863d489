"""Define the commands `derive` and `compare` with their options, a file each."""
