"""Gesture synthesis for speech and silence: expression, brows, blinks, cheeks, gaze and head."""
