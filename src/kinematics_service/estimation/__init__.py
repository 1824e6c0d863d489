"""Keep joint states in memory, and turn them into states of the tool and warnings."""
