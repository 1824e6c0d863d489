"""What the command writes of a calibration: robot file, report, and a page with pictures."""
