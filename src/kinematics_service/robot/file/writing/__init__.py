"""Robot files written: new ones, and sections set into those that are there."""
