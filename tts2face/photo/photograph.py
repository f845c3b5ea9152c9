"""Picture files of people, read as upright sRGB pixels."""

import io
import re
from contextlib import AbstractContextManager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from lexicon.errors import DataError, InputError
from tts2face.numeric.arrays import Pixels
from tts2face.storage.pictures import open_picture

if TYPE_CHECKING:
    from PIL.Image import Image as Picture


FORMATS = ("JPEG", "PNG", "WEBP", "TIFF", "BMP", "GIF")  # of Pillow; HEIF besides
ADVICE = "give a JPEG, PNG, WebP, HEIC or TIFF picture"
MIN_SIDE_PX = 64
MAX_FILE_PIXELS = 60_000_000
KEPT_WIDTH, KEPT_HEIGHT = 3840, 2160  # pixels of a picture that is drawn at its own size; larger ones are reduced
NUMBERED = re.compile(r"(.+)@(\d{1,3})")  # a photo, and which of its faces
OPAQUE, HALF = 255, 128
WIDE_MODES = ("I", "I;16", "I;16L", "I;16B", "I;16N")  # of Pillow: greys of more than 8 bits
HEIC_BRANDS = (b"heic", b"heix", b"heim", b"heis", b"hevc", b"mif1", b"msf1")


@dataclass(frozen=True, slots=True, eq=False)
class Photograph:
    """A picture.

    Parameters
    ----------
    pixels : (H, W, 3)
        sRGB, upright.
    alpha : (H, W) or None
        Coverage; None for an opaque picture.
    reduced_by
        Pixels of the file along a side for each of these.
    behind : (H, W, 3) or None
        The picture's own background behind what `alpha` covers.
    """

    pixels: Pixels
    alpha: Pixels | None
    reduced_by: float
    behind: Pixels | None = None

    def filled(self) -> "Photograph":
        """The picture with the colour of the nearest opaque pixel where it is transparent."""
        if self.alpha is None or not (self.alpha >= HALF).any():
            return self
        from scipy.ndimage import distance_transform_edt

        rows, columns = distance_transform_edt(self.alpha < HALF, return_distances=False, return_indices=True)
        return replace(self, pixels=np.ascontiguousarray(self.pixels[rows, columns]))


def read_photograph(path: Path) -> Photograph:
    """Read a picture file: upright by its EXIF data, in sRGB by its colour profile, reduced if it is very large."""
    from PIL import ImageOps

    with open_photograph(path) as file:
        width, height = file.size
        if width * height > MAX_FILE_PIXELS:
            raise DataError(
                f"the photo {path} has {width} x {height} pixels; at most {MAX_FILE_PIXELS // 1_000_000} million are "
                "read: reduce its size"
            )
        if min(width, height) < MIN_SIDE_PX:
            raise DataError(
                f"the photo {path} has {width} x {height} pixels; give one with at least {MIN_SIDE_PX} along each side"
            )
        file.draft(
            None, (KEPT_WIDTH, KEPT_WIDTH)
        )  # JPEG: decoded at a half, a quarter or an eighth where that suffices
        picture = ImageOps.exif_transpose(file)
        scale = min(1.0, KEPT_WIDTH / picture.width, KEPT_HEIGHT / picture.height)
        if scale < 1:
            picture = _reduced(picture, scale)
        colours, alpha = _colours(picture)
    return Photograph(colours, alpha, max(width, height) / max(colours.shape[:2]))


def open_photograph(path: Path) -> AbstractContextManager["Picture"]:
    """The file of a picture, opened; its pixels are decoded at their first use. Errors as `read_photograph`."""
    formats = ("HEIF",) if _is_heic(path) else FORMATS
    return open_picture(path, "the photo", formats, advice=ADVICE)


def _is_heic(path: Path) -> bool:
    """Whether a file is HEIC, which Pillow then reads."""
    try:
        with path.open("rb") as file:
            first = file.read(12)
    except OSError:
        return False  # said when it is opened
    if first[4:8] != b"ftyp" or first[8:12] not in HEIC_BRANDS:
        return False
    try:
        from pillow_heif import register_heif_opener
    except ImportError as missing:
        raise DataError(
            f"the photo {path} is HEIC, which needs pillow-heif: run pip install 'tts2face[photo]', or give a JPEG"
        ) from missing
    register_heif_opener()
    return True


def _reduced(picture: "Picture", scale: float) -> "Picture":
    from PIL import Image

    size = (max(1, round(picture.width * scale)), max(1, round(picture.height * scale)))
    if picture.mode in ("P", "1", *WIDE_MODES):
        picture = _eight_bits(picture)
    return picture.resize(size, Image.Resampling.LANCZOS)


def _eight_bits(picture: "Picture") -> "Picture":
    """A picture of 8 bits a number, without a palette."""
    from PIL import Image

    if picture.mode in WIDE_MODES:
        return Image.fromarray((np.asarray(picture).clip(0, 65535) // 257).astype(np.uint8))
    if picture.mode == "F":
        values = np.asarray(picture)
        most = 1.0 if np.nanmax(values, initial=0.0) <= 1 else 255.0
        return Image.fromarray(np.rint(np.nan_to_num(values / most).clip(0, 1) * 255).astype(np.uint8))
    if picture.mode in ("P", "PA", "1"):
        return picture.convert("RGBA" if "transparency" in picture.info or picture.mode == "PA" else "RGB")
    return picture


def _colours(picture: "Picture") -> tuple[Pixels, Pixels | None]:
    """Colours (H, W, 3) in sRGB, and coverage (H, W) where any pixel is not opaque."""
    profile = picture.info.get("icc_profile")
    transparency = picture.info.get("transparency")
    picture = _eight_bits(picture)
    if transparency is not None and picture.mode in ("L", "RGB"):
        picture.info["transparency"] = transparency
        picture = picture.convert("RGBA")
    alpha = None
    if "A" in picture.getbands():
        alpha = np.array(picture.getchannel("A"))
        picture = picture.convert("RGB")
    colours = np.array(_in_srgb(picture, profile))
    return colours, None if alpha is None or (alpha == OPAQUE).all() else alpha


def _in_srgb(picture: "Picture", profile: bytes | None) -> "Picture":
    """A picture as RGB; one without a profile, or with a damaged one, is taken as it is."""
    from PIL import ImageCms

    if profile:
        try:
            source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
            found = ImageCms.profileToProfile(picture, source, ImageCms.createProfile("sRGB"), outputMode="RGB")
        except (ImageCms.PyCMSError, OSError, ValueError):
            found = None
        if found is not None:
            return found
    return picture.convert("RGB")


def split_number(photo: str | Path) -> tuple[Path, int]:
    """Path of a photo, and which of its faces: ``photo.jpg@2`` is the second largest one."""
    path, number = Path(photo), 1
    match = NUMBERED.fullmatch(str(photo))
    if match is not None and not path.exists():
        path, number = Path(match[1]), int(match[2])
    if not path.is_file():
        raise InputError(f"there is no photo {path}; check the path")
    return path, number
