"""Takes of a person who moves the head, recorded or live."""
