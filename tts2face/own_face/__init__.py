"""A talker's own face, drawn on the talker's own video."""
