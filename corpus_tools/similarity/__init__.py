"""How alike phones look on one talker's face, and how far that can be trusted: for people who study visual speech."""
