"""Parse a file of formulas: tokens, grammar, and lines."""
