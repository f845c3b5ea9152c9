"""Training of talker models from observed recordings."""
