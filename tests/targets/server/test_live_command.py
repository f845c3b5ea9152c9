"""``tts2face live`` with a made world, and the process in which the service shows a face."""
