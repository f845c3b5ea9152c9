"""Text to phones: normalisation, dictionaries, grapheme-to-phoneme, the phone table."""
