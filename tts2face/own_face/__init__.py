"""Appearance and gestures of a talker's own face."""
