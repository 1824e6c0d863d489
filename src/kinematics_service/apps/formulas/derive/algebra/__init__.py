"""Exact algebra of sines, cosines and lengths."""
