"""Recordings of a person, and the talkers that are built of them."""
