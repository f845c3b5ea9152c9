"""From a talker's videos to a textured head of the talker."""
