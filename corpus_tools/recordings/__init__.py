"""Recordings of a person, observed: sound, phones, landmarks, on one clock."""
