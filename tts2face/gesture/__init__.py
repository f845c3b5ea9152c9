"""Gestures: expression, brows, lids, cheeks, gaze and head, as Markov random fields over recorded styles."""
