"""A file of formulas as a person wrote it: its words, its grammar, its lines."""
