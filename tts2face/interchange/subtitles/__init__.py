"""Subtitle files as cues: SubRip, WebVTT, SubStation Alpha and TTML, by one tolerant reader."""
