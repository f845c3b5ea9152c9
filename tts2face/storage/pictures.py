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
MAX_DECODING_BYTES = 1 << 30  # of one picture; a file of 2 KB can take that
# Bytes that Pillow takes for a pixel while it decodes a format, measured; the largest one for others.
PIXEL_BYTES = {"PNG": 4, "TIFF": 4, "BMP": 4, "GIF": 4, "JPEG": 4, "AVIF": 9, "HEIF": 12, "WEBP": 16, "JPEG2000": 19}
PROGRESSIVE_BYTES = 7  # of a JPEG whose pixels come in several passes
OTHER_MODE_BYTES = 4  # of a pixel of the copy as RGB


def decoding_bytes(picture: "Picture") -> int:
    """Memory that a picture of Pillow takes when it is decoded as RGB, by its size, format and mode."""
    format = str(picture.format)
    a_pixel = PIXEL_BYTES.get(format, max(PIXEL_BYTES.values()))
    if format == "JPEG" and "progressive" in picture.info:
        a_pixel = PROGRESSIVE_BYTES
    return picture.width * picture.height * (a_pixel + (picture.mode != "RGB") * OTHER_MODE_BYTES)


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
        It is not a picture, is damaged, has more than `MAX_PIXELS`, or takes more than `MAX_DECODING_BYTES` to decode;
        the message begins with `what`.
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
                if (n_bytes := decoding_bytes(picture)) > MAX_DECODING_BYTES:
                    raise DataError(
                        f"{name} takes {n_bytes >> 20} MB to decode, a {picture.format} of {width} x {height} pixels, "
                        f"more than {MAX_DECODING_BYTES >> 20}; save it in another format, or reduce its size"
                    )
                yield picture
    except too_large as error:
        raise DataError(f"{name} is too large; {limit}") from error
    # Pillow's decoders raise any of these for damaged files (SyntaxError for PNG)
    except (UnidentifiedImageError, OSError, EOFError, SyntaxError, ValueError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"cannot read {name}; {advice}") from error
