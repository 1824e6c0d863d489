"""The clearance: a proved radius, rad, around joint positions without singular poses."""
