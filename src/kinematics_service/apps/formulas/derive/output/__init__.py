"""A derivation as text, page, LaTeX, code or picture."""
