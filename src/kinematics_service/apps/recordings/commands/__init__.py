"""Define the command `audit` and its options, one file for each group of options."""
