"""Child processes: one message, one loop of a child over a table of handlers, its parents; threads; shared values."""
