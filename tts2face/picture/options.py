"""Drawing options of a clip; a module without heavy imports."""

import re
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import InputError
from lexicon.values.fields import check_fields
from lexicon.values.files import is_file
from tts2face.option import option
from tts2face.picture.camera_view import CameraView, parse_camera

SIDE_LIMITS_PX = (16, 4096)  # px
AUTO_SIZE, DEFAULT_SIZE = "auto", (512, 512)
SUPERSAMPLING_FACTORS = (1, 2, 3)
DRAFT, STANDARD, HIGH = QUALITIES = ("draft", "standard", "high")
HIGH_SUPERSAMPLING = 3
NUMBA = "numba"
STUDIO, TRANSPARENT, BLUR = "studio", "transparent", "blur"
COLOURS = {
    "black": "000000", "white": "ffffff", "grey": "808080", "gray": "808080", "red": "c8282d", "green": "00b140",
    "blue": "0047bb", "navy": "14213d", "sky": "9ec9e8", "teal": "127475", "yellow": "f2c14e", "orange": "e07a1f",
    "pink": "f4b6c2", "purple": "5f4b8b", "brown": "6b4f3a", "cream": "f6f0e2",
}  # fmt: skip  # sRGB; green and blue are the usual chroma key colours
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".webp", ".bmp", ".tif", ".tiff")


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """Drawing options of a clip.

    Raises
    ------
    InputError
        An option has a value of another type, is out of range or unknown.
    """

    size: str = option(
        "auto",
        "Width x height in pixels, even numbers from 16 to 4096; auto: 512x512, or the size of a talker's own video.",
    )
    camera: str = option("front", "front, three-quarter, profile, close, or yaw,pitch[,distance] in degrees and mm.")
    background: str = option(
        "studio", "studio, transparent, blur (of a photo's own), a colour (name or #rrggbb), or an image file."
    )
    supersampling: int = option(2, "Samples along each side of a pixel: 1, 2 or 3.", limits=(1, 3))
    quality: str = option(
        "standard",
        "draft (one sample a pixel, no light under the skin), standard, or high (3 x 3 samples in every pixel).",
        choices=QUALITIES,
    )
    renderer: str = option(NUMBA, "numba, which draws every picture on any machine.", choices=(NUMBA,))
    visible_mark: bool = option(False, "Write the word synthetic into the lower right corner of clips.")

    def __post_init__(self) -> None:
        """Validate every option."""
        check_fields(self)
        parse_size(self.size)
        parse_camera(self.camera)
        parse_background(self.background)
        if self.supersampling not in SUPERSAMPLING_FACTORS:
            raise InputError(f"supersampling must be 1, 2 or 3, not {self.supersampling}")
        if self.quality not in QUALITIES:
            raise InputError(f"there is no quality {self.quality!r}; choose {', '.join(QUALITIES)}")
        if self.renderer != NUMBA:
            raise InputError(f"there is no renderer {self.renderer!r}; numba draws every picture: remove --renderer")

    @property
    def width(self) -> int:
        """Pixels across."""
        return parse_size(self.size)[0]

    @property
    def height(self) -> int:
        """Pixels down."""
        return parse_size(self.size)[1]

    @property
    def samples_per_side(self) -> int:
        """Samples along each side of a pixel, by quality and supersampling."""
        return {DRAFT: 1, HIGH: HIGH_SUPERSAMPLING}.get(self.quality, self.supersampling)

    @property
    def samples(self) -> tuple[int, int]:
        """Samples across and down."""
        return self.width * self.samples_per_side, self.height * self.samples_per_side

    @property
    def view(self) -> CameraView:
        """Camera view that `camera` names."""
        return parse_camera(self.camera)

    @property
    def is_transparent(self) -> bool:
        """Whether pictures have a fourth channel with their coverage."""
        return self.background == TRANSPARENT

    @property
    def channels(self) -> int:
        """Number of channels of a picture: 3, or 4 with coverage."""
        return 4 if self.is_transparent else 3


def parse_size(size: str) -> tuple[int, int]:
    """Width and height in pixels of a size such as ``640x480`` or ``512``; `DEFAULT_SIZE` for ``auto``.

    Raises
    ------
    InputError
        The text is not a size, or a side is odd or out of range.
    """
    if size.strip() == AUTO_SIZE:
        return DEFAULT_SIZE
    match = re.fullmatch(r"\s*(\d{1,9})\s*(?:[xX×,]\s*(\d{1,9})\s*)?", size)
    if match is None:
        raise InputError(f"size must be width x height such as 640x480, not {size!r}")
    width, height = int(match[1]), int(match[2] or match[1])
    for side in (width, height):
        # H.264 halves the colours of both directions: sides are even
        if not SIDE_LIMITS_PX[0] <= side <= SIDE_LIMITS_PX[1] or side % 2:
            raise InputError(
                f"size must be even numbers from {SIDE_LIMITS_PX[0]} to {SIDE_LIMITS_PX[1]}, not {width}x{height}"
            )
    return width, height


def parse_background(background: str) -> tuple[int, int, int] | Path | str:
    """Colour (sRGB, 0-255), image path, or the word ``studio``, ``transparent`` or ``blur``."""
    if background in (STUDIO, TRANSPARENT, BLUR):
        return background
    digits = COLOURS.get(background.lower(), background.removeprefix("#"))
    if re.fullmatch(r"[0-9a-fA-F]{3}", digits):
        # #rgb as in CSS
        digits = "".join(2 * digit for digit in digits)
    if re.fullmatch(r"[0-9a-fA-F]{6}", digits):
        return int(digits[:2], 16), int(digits[2:4], 16), int(digits[4:], 16)
    path = Path(background)
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise InputError(
            f"there is no background {background!r}; give studio, transparent, blur, #rrggbb, an image file, "
            f"or one of {', '.join(COLOURS)}"
        )
    if not is_file(path):
        raise InputError(f"there is no background image {background}; check the path")
    return path
