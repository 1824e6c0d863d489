"""Compute the solution curves of an arm that has one joint more than its target has equations."""
