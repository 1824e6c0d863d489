"""The text of a robot file: YAML with its lines, its faults, entries and expressions."""
