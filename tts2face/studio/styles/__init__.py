"""Own styles of a palette."""
