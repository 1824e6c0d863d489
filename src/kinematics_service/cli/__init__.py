"""The command line: one file for each command, and the functions that several commands use."""
