"""Write robot files: new files, and new sections of existing files."""
