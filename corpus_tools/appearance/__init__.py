"""Appearance models: from tracked pictures of a talker to models of shape and texture (T07, section 2)."""
