"""Builders of the shipped models; in the repository only, and imported by nothing that a wheel holds."""
