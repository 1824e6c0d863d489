"""Define the messages that the node receives and publishes, and how they are made."""
