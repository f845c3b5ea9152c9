"""Lip motion: from recorded examples (Theobald et al. 2007, section 3.3), and on the face of another."""
