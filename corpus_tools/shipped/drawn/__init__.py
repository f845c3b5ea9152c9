"""Drawn characters: designed heads of an animated film's kind, on the shipped heads' topology."""
