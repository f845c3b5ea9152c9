"""A small label in the corner of pictures, which says that they are synthetic."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import Picture
from tts2face.types import Clip

TEXT = "synthetic"
HEIGHT, LEAST_PX = 0.035, 9  # of the letters, of the height of a picture
MARGIN = 0.5  # of the height of the letters, around the label
SHADE, PAPER, INK = 0.55, 0, 255  # opacity and brightness of the ground, and of the letters


@dataclass(frozen=True, slots=True, eq=False)
class MarkedRenderer:
    """A renderer whose pictures have the label; implements `tts2face.picture.frame_renderer.FrameRenderer`."""

    renderer: FrameRenderer
    label: NDArray[np.float32]

    @property
    def picture(self) -> Picture:
        """Drawing options of the frames."""
        return self.renderer.picture

    @property
    def notice(self) -> str:
        """Comment for every file with these frames."""
        return self.renderer.notice

    def frames(
        self, clip: Clip, numbers: Iterable[int] | None = None, *, threads: int | None = None, first: int = 0
    ) -> Iterator[NDArray[np.uint8]]:
        """Pictures (H, W, 3 or 4) of a clip's frames in order; errors as of the renderer."""
        return map(self._marked, self.renderer.frames(clip, numbers, threads=threads, first=first))

    def frame(self, clip: Clip, number: int) -> NDArray[np.uint8]:
        """Picture of one frame of a clip."""
        return self._marked(self.renderer.frame(clip, number))

    def with_fewest_samples(self) -> FrameRenderer:
        """Renderer with one sample a pixel."""
        return MarkedRenderer(self.renderer.with_fewest_samples(), self.label)

    def _marked(self, pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
        return _with_label(pixels, self.label)


def mark_picture(pixels: NDArray[np.uint8], picture: Picture) -> NDArray[np.uint8]:
    """A picture (H, W, 3 or 4), with the label where it shall have it."""
    return _with_label(pixels, _label(*pixels.shape[1::-1])) if picture.visible_mark else pixels


def _with_label(pixels: NDArray[np.uint8], label: NDArray[np.float32]) -> NDArray[np.uint8]:
    height, width = label.shape
    marked = pixels.copy()
    part = marked[-height:, -width:]
    brightness = PAPER + (INK - PAPER) * label[..., None]
    opacity = np.maximum(label, SHADE)[..., None]
    part[..., :3] = np.rint(part[..., :3] * (1 - opacity) + brightness * opacity).astype(np.uint8)
    if pixels.shape[2] == 4:
        part[..., 3] = np.maximum(part[..., 3], np.rint(255 * opacity[..., 0])).astype(np.uint8)
    return marked


def marked(renderer: FrameRenderer) -> FrameRenderer:
    """The renderer, with the label in its pictures where they shall have it."""
    picture = renderer.picture
    return MarkedRenderer(renderer, _label(picture.width, picture.height)) if picture.visible_mark else renderer


def _label(width: int, height: int) -> NDArray[np.float32]:
    """(h, w) share of the ink in the pixels of the label, in the lower right corner of a picture of a size."""
    from PIL import Image, ImageDraw, ImageFont

    size = max(LEAST_PX, round(HEIGHT * height))
    font = ImageFont.load_default(size)
    left, top, right, bottom = font.getbbox(TEXT)
    margin = round(MARGIN * size)
    drawn = Image.new("L", (int(right - left) + 2 * margin, int(bottom - top) + 2 * margin))
    ImageDraw.Draw(drawn).text((margin - left, margin - top), TEXT, fill=255, font=font)
    shares: NDArray[np.float32] = np.asarray(drawn, np.float32)[:height, :width] / np.float32(255)
    return shares
