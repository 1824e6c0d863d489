"""Turn pasted Denavit-Hartenberg tables into robot files."""
