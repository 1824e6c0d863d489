"""Curves of solutions of an arm with one joint more than its target asks for."""
