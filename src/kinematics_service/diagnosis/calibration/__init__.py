"""From the nominal table to one very robot: its numbers identified from measured poses."""
