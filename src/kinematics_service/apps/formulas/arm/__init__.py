"""The table of an arm in symbols, and its frames and Jacobian in numbers at many poses."""
