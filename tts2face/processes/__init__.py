"""Child processes: one message, one loop of a child over a table of handlers, and its parents."""
