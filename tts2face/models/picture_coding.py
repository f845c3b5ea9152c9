"""Pictures within model files: pixels as JPEG, coverage as PNG."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError

JPEG_QUALITY = 92
MAX_TEXTURE_SIDE_PX = 8192  # pixels per side: 200 MB when decoded


def texture_tensors(number: int) -> tuple[str, str]:
    """Names of the tensors that hold the colours and the alpha of a face's texture."""
    return f"texture{number or ''}", f"alpha{number or ''}"


def encode_colours(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """JPEG, as bytes (N,), of pixels (H, W, 3) or (H, W)."""
    return _encode(pixels, "JPEG", quality=JPEG_QUALITY, **({"subsampling": 0} if pixels.ndim == 3 else {}))


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
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content.tobytes()), formats=[kind]) as image:
            if max(image.size) > MAX_TEXTURE_SIDE_PX:
                raise DataError(
                    f"{path}: the texture has {image.size} pixels; reduce it to at most {MAX_TEXTURE_SIDE_PX} per side"
                )
            return np.array(image.convert(mode))
    except (OSError, SyntaxError) as error:
        raise DataError(f"{path}: the texture cannot be decoded ({error}); build or copy the file again") from error
