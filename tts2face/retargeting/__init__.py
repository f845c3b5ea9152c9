"""Motion of a talker or performer transferred to a face."""
