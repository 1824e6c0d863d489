"""
Merge joint states from messages, and compute the tool's state and singularity warnings from them.
"""
