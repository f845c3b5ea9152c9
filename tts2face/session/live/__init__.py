"""A live face: sentences, sound that arrives, listening and idle time on one clock, without an end."""
