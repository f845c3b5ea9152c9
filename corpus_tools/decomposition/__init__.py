"""Recordings taken apart: head pose, weights of basis expressions, and what each region of the face does besides."""
