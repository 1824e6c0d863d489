"""Statements of a file of formulas about a robot, and the checks of them."""
