"""Compute covariances of the tool's pose and twist from the uncertainty of an arm's parameters."""
