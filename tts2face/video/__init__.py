"""Watching: pictures to landmarks and head pose."""
