"""One arm, frozen: its table, its chain, its task and its measures; its files."""
