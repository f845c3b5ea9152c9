"""Motion of one talker transferred to another (Theobald et al. 2007, eq. 5)."""
