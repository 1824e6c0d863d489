"""Check plans, and state for each claim whether it is proved, refuted, or not decided."""
