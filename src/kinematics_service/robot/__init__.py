"""Describe one arm: its files, DH table, kinematic chain, task and measures of singularity."""
