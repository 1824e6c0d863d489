"""The robot's own frames, Jacobian and other quantities, in symbols and in numbers."""
