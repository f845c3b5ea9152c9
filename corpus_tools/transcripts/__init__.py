"""Readers of what is said in a recording, one file format each."""
