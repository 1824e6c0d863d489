"""Measures of the distance of an arm from a singular pose."""
