"""The parts of a robot file, each read into what describes it."""
