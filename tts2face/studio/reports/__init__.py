"""Reports of models."""
