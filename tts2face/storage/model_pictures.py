"""Pictures within model files: pixels as JPEG, coverage as PNG."""

import io
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.storage.pictures import open_picture

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
