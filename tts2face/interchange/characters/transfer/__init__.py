"""Shapes of a shipped head carried over to a head without any, so that it speaks."""
