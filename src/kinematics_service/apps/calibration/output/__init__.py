"""The outputs of the command: robot file, report, and a page with pictures."""
