"""Reading of picture files, with a limit on their size that is checked before they are decoded."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lexicon.errors import DataError

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

MAX_PIXELS = 100_000_000  # 300 MB as RGB; a small file can declare any size


@contextmanager
def open_picture(path: Path, what: str) -> Iterator["Picture"]:
    """Open a picture file; its pixels are decoded on first use within the block.

    Raises
    ------
    DataError
        The file is not a picture, is damaged, or has more than `MAX_PIXELS`; the message begins with `what`.
    """
    from PIL import Image, UnidentifiedImageError

    too_large = (Image.DecompressionBombWarning, Image.DecompressionBombError)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            file = Image.open(path)
        with file:
            width, height = file.size
            if width * height > MAX_PIXELS:
                raise DataError(f"{what} {path} has {width} x {height} pixels; {_too_many()}")
            yield file
    except too_large as error:
        raise DataError(f"{what} {path} is too large; {_too_many()}") from error
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"cannot read {what} {path}; give a PNG, JPEG or WebP picture") from error


def _too_many() -> str:
    return f"at most {MAX_PIXELS // 1_000_000} million are read; reduce its size"
