"""Run the process around the node: its start, its executor, its end."""
