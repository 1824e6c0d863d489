"""Parse the text of a robot file: YAML with line numbers, faults, entries and expressions."""
