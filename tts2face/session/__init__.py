"""From a request to a clip: text, recordings and performances, in pieces."""
