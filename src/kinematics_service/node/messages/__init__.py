"""Define the messages that the node receives and publishes, and fill them with numbers."""
