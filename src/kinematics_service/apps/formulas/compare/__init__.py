"""Check formulas that a user wrote against the exact derivation."""
