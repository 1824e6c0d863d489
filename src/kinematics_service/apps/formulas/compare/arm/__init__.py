"""The quantities that formulas name, in symbols and in numbers."""
