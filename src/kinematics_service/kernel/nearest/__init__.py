"""The search for the singular pose nearest to a pose, and the clearance from singular poses."""
