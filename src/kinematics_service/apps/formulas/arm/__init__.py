"""
Write the table of an arm in symbols, and evaluate its frames and Jacobian at many configurations.
"""
