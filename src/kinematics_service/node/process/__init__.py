"""Run the process of a node: its start, its executor, and its end."""
