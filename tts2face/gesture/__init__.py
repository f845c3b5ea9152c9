"""Expression, brows, blinks, cheeks, gaze and head: gestures that go with speech, or with silence."""
