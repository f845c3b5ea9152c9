"""Arrays of bytes that are deflated in a file."""

import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError

LEVEL = 9


def deflate(content: bytes) -> NDArray[np.uint8]:
    """Deflated bytes (N,)."""
    return np.frombuffer(zlib.compress(content, LEVEL), np.uint8)


def inflate(content: NDArray[Any], size: int, what: str, path: Path) -> bytes:
    """So many bytes of what `deflate` returned; `what` names them in messages.

    Raises
    ------
    DataError
        The bytes are damaged or of another size.
    """
    try:
        found = zlib.decompressobj().decompress(content.tobytes(), size + 1)
    except zlib.error as error:
        raise DataError(f"{path}: the {what} cannot be inflated ({error}); build or copy the file again") from error
    if not size or len(found) != size:
        raise DataError(f"{path}: the {what} is not of {size} bytes; build or copy the file again")
    return found
