"""Closed loops: the passive variables and their rates from the joints."""
