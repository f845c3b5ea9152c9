"""A clip in other formats."""
