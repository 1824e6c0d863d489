"""Files of other people: robot descriptions, recordings, plans."""
