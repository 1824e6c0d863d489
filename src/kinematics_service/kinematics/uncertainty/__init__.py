"""Compute covariances of pose and twist from the uncertainty of an arm's parameters."""
