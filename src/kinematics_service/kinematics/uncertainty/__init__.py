"""Uncertainty of an arm's parameters, and the covariances of pose and twist that follow."""
