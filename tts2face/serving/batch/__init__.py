"""Subtitles to clips: cast, plan, fit to the cues, segments, assembly and manifest."""
