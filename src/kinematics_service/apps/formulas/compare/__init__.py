"""A person's formulas checked against the derivation."""
