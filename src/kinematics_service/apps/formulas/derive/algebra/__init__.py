"""Compute exactly with polynomials in sines, cosines and lengths."""
