"""Compiled parts of the renderer."""
