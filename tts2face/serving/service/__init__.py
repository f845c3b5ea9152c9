"""The HTTP service: `tts2face.Session` and the jobs behind an API."""
