"""Postures of an arm: whether it can change from one to another without a singular pose."""
