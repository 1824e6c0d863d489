"""Audit a dataset episode by episode: make findings, label all frames, and write one table."""
