"""Datasets audited episode by episode: findings, labels of every frame, one table for all."""
