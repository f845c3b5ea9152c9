"""Similarity of phones on one talker's face, and its reliability: for the study of visual speech."""
