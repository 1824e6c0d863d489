"""Find why a formula is wrong: test likely mistakes."""
