"""Compute measures of how near an arm is to a singular pose."""
