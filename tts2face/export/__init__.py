"""Export of words and phones in text formats."""
