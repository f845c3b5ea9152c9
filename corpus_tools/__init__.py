"""Tools that build talkers, faces and palettes from recordings, and evaluate them."""
