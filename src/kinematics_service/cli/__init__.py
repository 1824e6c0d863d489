"""Define the command line: one file for each command, and functions that several commands use."""
