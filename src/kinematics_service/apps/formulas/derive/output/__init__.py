"""Write a derivation as text, page, LaTeX, source code, JSON or notebook output."""
