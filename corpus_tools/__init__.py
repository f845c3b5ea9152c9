"""Recordings to talkers, heads to faces, and the measures of both."""
