"""Plans with a verdict: what is proved of a motion between its points too, and what is refuted."""
