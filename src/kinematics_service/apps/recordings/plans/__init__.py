"""
Check plans, and state for each claim about a plan whether it is proved, refuted, or not decided.
"""
