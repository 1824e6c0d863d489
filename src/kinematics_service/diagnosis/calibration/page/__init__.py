"""A calibration as one page with pictures."""
