"""The commands of this app, a file each, and their options."""
