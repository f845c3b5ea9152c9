"""Picture files that a user names, refused by their stated size before they are decoded."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from lexicon.errors import DataError

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

MOST_PIXELS = 100_000_000  # 300 MB as RGB; few cameras have more, and a small file may state any number


@contextmanager
def opened_picture(path: Path, what: str) -> Iterator["Picture"]:
    """A picture file whose header is read; its pixels are decoded when they are used within the block.

    Raises
    ------
    DataError
        It is no picture, is damaged, or has more than `MOST_PIXELS`; the message calls it `what`.
    """
    from PIL import Image, UnidentifiedImageError

    bombs = (Image.DecompressionBombWarning, Image.DecompressionBombError)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            file = Image.open(path)
        with file:
            width, height = file.size
            if width * height > MOST_PIXELS:
                raise DataError(f"{what} {path} has {width} x {height} pixels; {_too_many()}")
            yield file
    except bombs as bomb:
        raise DataError(f"{what} {path} is too large; {_too_many()}") from bomb
    except (UnidentifiedImageError, OSError, SyntaxError, ValueError) as broken:
        if isinstance(broken, DataError):
            raise
        raise DataError(f"cannot read {what} {path}; give a PNG, JPEG or WebP picture") from broken


def _too_many() -> str:
    return f"at most {MOST_PIXELS // 1_000_000} million are read: make it smaller"
