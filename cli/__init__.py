"""Doors for people: flags, progress bars, exit codes."""
