"""Kinds of jobs as clients ask for them; `tts2face.serving.work.kinds` executes them."""
