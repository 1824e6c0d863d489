"""Denavit-Hartenberg tables as people have them, turned into robot files."""
