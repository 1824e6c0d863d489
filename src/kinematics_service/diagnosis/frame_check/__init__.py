"""
Compares the tool poses of a robot file with those of a second source, and finds the cause of a
difference.
"""
