"""Describe one arm: its table, chain, task and measures, and the files it is read from."""
