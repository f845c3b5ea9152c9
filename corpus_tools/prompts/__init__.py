"""Prompts to read aloud for a recording: selected for their coverage of phones in visible contexts."""
