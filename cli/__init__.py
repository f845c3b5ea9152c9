"""Command line: flags, progress bars, exit codes."""
