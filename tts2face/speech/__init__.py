"""Listening: sound to phone edges and features."""
