"""Textured dense heads of talkers, built from videos."""
