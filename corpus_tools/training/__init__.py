"""Observed recordings become models."""
