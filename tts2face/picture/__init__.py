"""Rendering of clips to pictures, video files and windows."""
