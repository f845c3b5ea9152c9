"""Evaluation of synthesised lip motion against held-out recordings."""
