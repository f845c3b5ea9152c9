"""A live face: sentences, sound that arrives, listening and idle time on one clock, without an end."""

AHEAD_S = 0.2  # of frames in the line of a stream: six at 30 a second
