"""Materials of .obj files: colours, images and transparency of .mtl libraries."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.files import read_text
from tts2face.interchange.characters.character import BLEND, Material
from tts2face.interchange.characters.materials import decode_image
from tts2face.interchange.gltf.reader import read_bytes
from tts2face.picture.kernels.tones import linear_light

MAX_TEXT_BYTES = 200_000_000
GREY = 0.02  # greatest difference between the channels of a colour that exporters write for an unpainted material


def read_lines(path: Path) -> list[str]:
    """Lines of a text file.

    Raises
    ------
    DataError
        The file cannot be read or is too large.
    """
    try:
        return read_text(path, MAX_TEXT_BYTES).splitlines()
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused


def read_libraries(folder: Path, libraries: Iterable[str]) -> dict[str, Material]:
    """Materials by name of the .mtl files in a folder; missing files are skipped.

    ``map_Kd`` is the image, ``Kd`` the colour without one, ``d`` or ``Tr`` the transparency; ``map_d``, or the alpha of
    the image, is where the material has holes.
    """
    found: dict[str, Material] = {}
    for library in libraries:
        path = _beside(folder, library)
        name, fields = "", dict[str, str]()
        for line in [*(read_lines(path) if path is not None else ()), "newmtl"]:
            key, _, rest = line.strip().partition(" ")
            if key == "newmtl":
                if name:
                    # of two libraries with one name the first counts
                    found.setdefault(name, _material(name, fields, folder))
                name, fields = rest.strip(), {}
            else:
                fields[key] = rest.strip()
    return found


def _material(name: str, fields: dict[str, str], folder: Path) -> Material:
    image = _image(folder, fields.get("map_Kd", ""))
    holes = _image(folder, fields.get("map_d", ""))
    if image is not None and holes is not None:
        image = _with_alpha(image, holes)
    opacity = _number(fields.get("d", "")) if "d" in fields else 1.0 - _number(fields.get("Tr", "0"))
    material = Material(name, (*_colour(fields, image), min(max(opacity, 0.0), 1.0)), image)
    has_holes = opacity < 1.0 or (image is not None and int(image[:, :, 3].min()) < 255)
    return replace(material, alpha_mode=BLEND) if has_holes else material


def _colour(fields: dict[str, str], image: NDArray[np.uint8] | None) -> tuple[float, float, float]:
    """Linear colour; white with an image, and for the grey of unpainted materials."""
    cells = fields.get("Kd", "").split()
    if image is not None or len(cells) < 3:
        return 1.0, 1.0, 1.0
    values = np.clip([_number(cell) for cell in cells[:3]], 0.0, 1.0)
    if float(np.ptp(values)) < GREY:
        return 1.0, 1.0, 1.0
    red, green, blue = linear_light(np.rint(255 * values).astype(np.uint8)).astype(float).tolist()
    return red, green, blue


def _with_alpha(image: NDArray[np.uint8], holes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Image (H, W, 4) whose alpha is that of another one, or its brightness where that one is opaque."""
    from PIL import Image

    has_alpha = int(holes[:, :, 3].min()) < 255
    alpha = holes[:, :, 3] if has_alpha else holes[:, :, :3].mean(axis=2).astype(np.uint8)
    size = (image.shape[1], image.shape[0])
    resized = np.array(Image.fromarray(alpha).resize(size, Image.Resampling.BILINEAR))
    return np.dstack([image[:, :, :3], resized])


def _image(folder: Path, statement: str) -> NDArray[np.uint8] | None:
    """Image (H, W, 4) that a statement names, which may hold spaces, or names after its options; None without one."""
    path = _beside(folder, statement) or _beside(folder, statement.rpartition(" ")[2])
    return None if path is None else decode_image(read_bytes(path), str(path))


def _number(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        return 1.0
    return value if np.isfinite(value) else 1.0


def _beside(folder: Path, name: str) -> Path | None:
    relative = Path(name)
    # a stranger's file must not name files outside its folder
    if not name or "\0" in name or relative.is_absolute() or ".." in relative.parts:
        return None
    path = folder / relative
    return path if path.is_file() else None
