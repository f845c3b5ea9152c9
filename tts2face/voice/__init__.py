"""Voices: text to sound with phone edges."""
