"""Decomposition of recordings into head pose, weights of basis expressions, and independent motion of regions."""
