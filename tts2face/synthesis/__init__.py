"""Synthesis of clips from text, recorded speech and recorded performances."""
