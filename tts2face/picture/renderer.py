"""Rendering of a mesh face, one frame or the frames of a clip, with or without the label of synthetic pictures."""

from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.deformation import REST_HEAD
from tts2face.models.face import Face
from tts2face.models.light import Baked, Lamps, Light, Photographed
from tts2face.picture.baked.scene import LitScene, build_lit_scene
from tts2face.picture.camera import CameraMatrices, camera_matrices
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import STANDARD, STUDIO, Picture
from tts2face.picture.scene import Scene, build_scene, draw_background
from tts2face.processes.threads import map_in_order
from tts2face.storage.marks import Mark
from tts2face.types import Clip

LABEL_TEXT = "synthetic"
LABEL_HEIGHT, LABEL_LEAST_PX = 0.035, 9  # of the letters, of the height of a picture
LABEL_MARGIN = 0.5  # of the height of the letters, around the label
SAFE_SHARE = 0.05  # of a picture's width and height between its edge and the label: the safe area of titles (EBU R 95)
SHADE, PAPER, INK = 0.55, 0, 255  # opacity and brightness of the ground, and of the letters


@dataclass(frozen=True, slots=True, eq=False)
class MeshRenderer:
    """Renderer of a mesh face; implements `tts2face.picture.frame_renderer.FrameRenderer`.

    ``buffers`` are those that no frame is drawn into at the moment.
    """

    scene: Scene | LitScene
    buffers: deque[Any] = field(default_factory=deque)

    @property
    def picture(self) -> Picture:
        """How the frames are drawn."""
        return self.scene.picture

    @property
    def mark(self) -> Mark:
        """Mark of every written file."""
        return self.scene.face.mark

    def frames(
        self, clip: Clip, numbers: Iterable[int] | None = None, *, threads: int | None = None, first: int = 0
    ) -> Iterator[NDArray[np.uint8]]:
        """Pictures (H, W, 3 or 4) of a clip's frames in order.

        The clip's channels are the first shapes of the face; weights of further shapes are 0.

        Raises
        ------
        InputError
            The clip's channels are not the first shapes of the face.
        """
        values = self._weights(clip)
        chosen = range(len(values)) if numbers is None else numbers
        poses = ((values[number], clip.head.values[number]) for number in chosen)
        yield from map_in_order(lambda pose: self._draw(*pose), poses, threads)

    def frame(self, clip: Clip, number: int) -> NDArray[np.uint8]:
        """Picture (H, W, 3 or 4) of one frame of a clip."""
        return self.draw(self._weights(clip)[number], clip.head.values[number])

    def draw(self, weights: NDArray[np.floating], head: NDArray[np.floating] = REST_HEAD) -> NDArray[np.uint8]:
        """Picture (H, W, 3 or 4) of the face for shape weights (K,) and a head pose (6,).

        Raises
        ------
        InputError
            The number of weights is not the number of the face's shapes.
        """
        n_shapes = len(self.scene.face.shape_names)
        if np.shape(weights) != (n_shapes,):
            raise InputError(f"the face has {n_shapes} shapes, not weights of shape {np.shape(weights)}")
        return self._draw(np.asarray(weights, np.float32), np.asarray(head, np.float32))

    def seen_by(self, optics: CameraMatrices) -> "MeshRenderer":
        """Renderer of the same face in pictures of another camera; a photograph has only its own."""
        return MeshRenderer(self.scene.seen_by(optics), self.buffers)

    def with_fewest_samples(self) -> "MeshRenderer":
        """Renderer with one sample a pixel."""
        fewest = replace(self.picture, supersampling=1, quality=STANDARD)
        if fewest.samples == self.picture.samples:
            return self
        return MeshRenderer(self.scene.with_picture(fewest))

    def _weights(self, clip: Clip) -> NDArray[np.float32]:
        names = self.scene.face.shape_names
        n_channels = len(clip.motion.channels)
        if clip.motion.channels != names[:n_channels]:
            raise InputError(
                "the clip's motion is not in the shapes of this face; make the clip with a session of this face"
            )
        if n_channels == len(names):
            return clip.motion.values
        return np.pad(clip.motion.values, ((0, 0), (0, len(names) - n_channels)))

    def _draw(self, weights: NDArray[np.float32], head: NDArray[np.float32]) -> NDArray[np.uint8]:
        picture, background = self.picture, self.scene.background
        pixels = np.zeros((picture.height, picture.width, picture.channels), np.uint8)
        pixels[:, :, : background.shape[2]] = background
        try:
            buffers = self.buffers.pop()
        # no buffers are free: another thread draws with each
        except IndexError:
            buffers = self.scene.allocate_buffers()
        self.scene.draw(weights, head, buffers, pixels)
        self.buffers.append(buffers)
        return pixels


def mesh_renderer(face: Face, picture: Picture) -> MeshRenderer:
    """Renderer of a face; build it once and draw many frames.

    Raises
    ------
    InputError
        The picture asks for what a photograph does not show.
    """
    if isinstance(face.light, Photographed):
        from tts2face.picture.baked.photo_scene import build_photo_scene

        return MeshRenderer(build_photo_scene(face, face.light, picture))
    if isinstance(face.light, Baked):
        background = draw_background(picture, face.light.baked.backdrop)
        optics = camera_matrices(picture.view, face, picture.samples)
        return MeshRenderer(build_lit_scene(face, face.light, picture, optics, background))
    return MeshRenderer(build_scene(face, picture))


def before_studio(renderer: MeshRenderer, studio: Light) -> MeshRenderer:
    """Renderer of a face without a studio of its own before that of another light, if no background is chosen.

    Faces of one film then stand before one wall.
    """
    own = renderer.scene.face.light
    if isinstance(studio, Lamps) or not isinstance(own, Lamps) or renderer.picture.background != STUDIO:
        return renderer
    background = draw_background(renderer.picture, studio.baked.backdrop)
    return replace(renderer, scene=replace(renderer.scene, background=background))


def draw(
    face: Face,
    weights: NDArray[np.floating] | None = None,
    head: NDArray[np.floating] = REST_HEAD,
    picture: Picture | None = None,
) -> NDArray[np.uint8]:
    """Picture of a face for one set of shape weights.

    Parameters
    ----------
    weights : (K,)
        Weights of the face's shapes; at rest when None.
    head : (6,)
        Head pose in the order of `tts2face.types.HEAD_CHANNELS`.
    picture
        Drawing options; the defaults when None.

    Returns
    -------
    (H, W, 3) or (H, W, 4)
        sRGB, with coverage (not premultiplied) when the background is transparent.

    Raises
    ------
    InputError
        The number of weights is not the number of the face's shapes.
    """
    shown = np.zeros(len(face.shape_names), np.float32) if weights is None else weights
    renderer = mesh_renderer(face, picture or Picture())
    return mark_picture(renderer.draw(shown, head), renderer.picture)


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
    def mark(self) -> Mark:
        """Mark of every file with these frames."""
        return self.renderer.mark

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
    down, right = (
        max(0, min(side - own, round((1 - SAFE_SHARE) * side) - own))
        for side, own in zip(pixels.shape, label.shape, strict=False)
    )
    part = marked[down : down + height, right : right + width]
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

    size = max(LABEL_LEAST_PX, round(LABEL_HEIGHT * height))
    font = ImageFont.load_default(size)
    left, top, right, bottom = font.getbbox(LABEL_TEXT)
    margin = round(LABEL_MARGIN * size)
    drawn = Image.new("L", (int(right - left) + 2 * margin, int(bottom - top) + 2 * margin))
    ImageDraw.Draw(drawn).text((margin - left, margin - top), LABEL_TEXT, fill=255, font=font)
    shares: NDArray[np.float32] = np.asarray(drawn, np.float32)[:height, :width] / np.float32(255)
    return shares
