"""Reading of picture files, with a limit on their size that is checked before they are decoded.

16-bit mono .wav files, written in parts.

Pictures within model files: pixels as JPEG, coverage as PNG.
"""

import io
import warnings
import wave
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

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
    except (UnidentifiedImageError, OSError, EOFError, SyntaxError, ValueError) as error:
        if isinstance(error, DataError):
            raise
        raise DataError(f"cannot read {name}; {advice}") from error


FULL_SCALE = 32767


def open_wave(target: str | BinaryIO, rate: int) -> wave.Wave_write:
    """Open a .wav file for writing at a path or in an open file; closing it completes its header."""
    file = wave.open(target, "wb")  # noqa: SIM115 - closed by the caller
    file.setparams((1, 2, rate, 0, "NONE", "not compressed"))
    return file


def pcm_bytes(samples: NDArray[np.floating]) -> bytes:
    """Samples (n,) in [-1, 1] as 16-bit integers."""
    steps: NDArray[np.int16] = np.rint(samples * FULL_SCALE).astype("<i2")
    return steps.tobytes()


def wave_bytes(samples: NDArray[np.floating], rate: int) -> bytes:
    """Content of a .wav file."""
    content = io.BytesIO()
    with open_wave(content, rate) as file:
        file.writeframes(pcm_bytes(samples))
    return content.getvalue()


JPEG_QUALITY = 92


def texture_tensors(number: int) -> tuple[str, str]:
    """Names of the tensors that hold the colours and the alpha of a face's texture."""
    return f"texture{number or ''}", f"alpha{number or ''}"


def encode_colours(pixels: NDArray[np.uint8], quality: int = JPEG_QUALITY) -> NDArray[np.uint8]:
    """JPEG, as bytes (N,), of pixels (H, W, 3) or (H, W)."""
    return _encode(pixels, "JPEG", quality=quality, **({"subsampling": 0} if pixels.ndim == 3 else {}))


def encode_coverage(alpha: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """PNG, as bytes (N,), of coverage (H, W)."""
    return _encode(alpha, "PNG")


def decode_colours(content: NDArray[np.uint8], path: Path, mode: str = "RGB") -> NDArray[np.uint8]:
    """Pixels of a JPEG in a mode of Pillow (RGB or L).

    Raises
    ------
    DataError
        The picture cannot be decoded or is too large.
    """
    return _decode(content, "JPEG", mode, path)


def decode_coverage(content: NDArray[np.uint8], path: Path) -> NDArray[np.uint8]:
    """Coverage (H, W) of a PNG; raises as `decode_colours`."""
    return _decode(content, "PNG", "L", path)


def _encode(pixels: NDArray[np.uint8], kind: str, **options: Any) -> NDArray[np.uint8]:
    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels).save(content, kind, **options)
    return np.frombuffer(content.getvalue(), np.uint8)


def _decode(content: NDArray[np.uint8], kind: str, mode: str, path: Path) -> NDArray[np.uint8]:
    what = f"the texture of {path}"
    with open_picture(content.tobytes(), what, (kind,), advice="build or copy the file again") as image:
        return np.array(image.convert(mode))
