"""Recordings of a person: sound, phones and landmarks on one time axis."""
