"""Talker, face and palette, and the files that hold them."""
