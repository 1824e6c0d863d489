"""The commands of this app, one file for each command, and their options."""
