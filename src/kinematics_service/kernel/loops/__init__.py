"""Closed loops: passive variables follow from the joints."""
