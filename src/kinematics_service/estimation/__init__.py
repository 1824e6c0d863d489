"""The one memory: from joint states to states of the tool, and warnings."""
