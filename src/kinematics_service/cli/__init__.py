"""The command line: one file a command, and the nouns they share."""
