"""Text-driven synthesis from exemplars (Theobald et al. 2007, section 3.3)."""
