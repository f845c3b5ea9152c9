"""Pictures and video of a clip."""
