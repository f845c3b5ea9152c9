

def _name_word(written: str) -> str:
    """A word of an address or tag, in a form that is read in no other way: small, or an initialism in capitals."""
    is_initialism = written.isupper() and len(written) > 1 and not re.fullmatch("[IVXLCDM]+", written)
