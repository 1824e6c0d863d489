"""The robot file: read, checked and written."""
