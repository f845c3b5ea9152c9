"""Files: read and written whole, checked, named, and never one that is also an input."""
