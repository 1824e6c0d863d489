"""Interface of the kernel to numpy arrays, and the indices of the numbers in the arrays."""
