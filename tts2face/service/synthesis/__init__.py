"""Synthesis processes of the service and what runs in them."""
