"""Measures of accuracy: reference motion, splits without shared recordings, methods, their scores and intervals."""
