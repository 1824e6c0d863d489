"""Factory calibrations, as manufacturers store them."""
