"""Audit datasets episode by episode: findings, labels of all frames, one table."""
