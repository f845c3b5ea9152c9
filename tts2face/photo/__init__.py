"""Photographs and pictures of people: reading, and the face in them."""
