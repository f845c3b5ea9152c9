"""Data models of talkers, faces and palettes, and their file formats."""
