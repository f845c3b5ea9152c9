"""Reading of picture files, with a limit on their size that is checked before they are decoded."""

import io
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
def open_picture(
    file: Path | bytes,
    what: str,
    formats: tuple[str, ...] | None = None,
    *,
    advice: str = "give a PNG, JPEG or WebP picture",
) -> Iterator["Picture"]:
    """Open a picture, a file or its content; its pixels are decoded on first use within the block.

    Parameters
    ----------
    what
        What the picture is, with the name of its file if it is content.
    formats
        Names of Pillow; None for all.
    advice
        What to do if it is not a picture.

    Raises
    ------
    DataError
        It is not a picture, is damaged, or has more than `MAX_PIXELS`; the message begins with `what`.
    """
    from PIL import Image, UnidentifiedImageError

    too_large = (Image.DecompressionBombWarning, Image.DecompressionBombError)
    name = f"{what} {file}" if isinstance(file, Path) else what
    limit = f"at most {MAX_PIXELS // 1_000_000} million are read; reduce its size"
    try:
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module=r"PIL\.")  # sizes are checked here
            picture = Image.open(file if isinstance(file, Path) else io.BytesIO(file), formats=formats)
            with picture:
                width, height = picture.size
                if width * height > MAX_PIXELS:
                    raise DataError(f"{name} has {width} x {height} pixels; {limit}")
                yield picture
    except too_large as error:
        raise DataError(f"{name} is too large; {limit}") from error
    except (UnidentifiedImageError, OSError, EOFError, SyntaxError, ValueError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"cannot read {name}; {advice}") from error
