"""Write the outputs of the calibration commands: robot file, report, and a page with pictures."""
