"""The search for garbage, which waits until a program has started."""

import gc


def pause_collection() -> None:
    """Stop the search for garbage: what imports and loads makes none, and each search visits all of it."""
    gc.disable()


def resume_collection() -> None:
    """Search for garbage again where it was paused, but not in what has been imported and loaded."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()
