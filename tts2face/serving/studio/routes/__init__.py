"""HTTP routes of the studio."""
