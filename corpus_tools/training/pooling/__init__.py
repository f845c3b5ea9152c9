"""Evidence of another speaker's lips, from landmark tracks without sound, for the networks of a talker."""
