"""Define the commands `demo` and `echo` and their options, one file for each."""
