"""
Give the kernel access to numpy arrays, and define the indices of the numbers in these arrays.
"""
