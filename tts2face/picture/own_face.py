"""Rendering of a talker's own face: the plate warped to the speech shape, plus the change of its texture.

The mean and the fine detail of the face texture cancel out: a frame is the plate's picture, warped with the landmarks,
plus the texture difference between the appearance parameters of speech and those of the plate. The face is not cut
out, so there is no seam. Only the inside of the mouth is drawn from its texture model alone. A ring of triangles around
the face absorbs the motion of the chin.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from tts2face.face.own_face import OwnFaceGestures
from tts2face.models.appearance import Appearance, nearest_pixels
from tts2face.models.landmarks import FACE_OVAL
from tts2face.models.light import person_mark
from tts2face.models.talker import ShapeModel, Talker
from tts2face.numeric.arrays import Float32Array
from tts2face.picture.kernels.warps import warp_image
from tts2face.picture.options import AUTO_SIZE, Picture
from tts2face.picture.plate import (
    FrameStore,
    TextureSamples,
    background_video_size,
    fit_background_video,
    texture_samples,
)
from tts2face.processes.threads import map_in_order
from tts2face.storage.marks import Mark
from tts2face.types import Clip

MOUTH_SUPERSAMPLING = 3  # samples along a pixel's side around the mouth, where the edge of the lips is drawn
MOUTH_MARGIN_PX = 3  # margin of the supersampled box around the mouth


@dataclass(frozen=True, slots=True, eq=False)
class OwnFaceRenderer:
    """Renderer of a talker's own face on its recorded video, a `tts2face.picture.frame_renderer.FrameRenderer`.

    Parameters
    ----------
    plate
        T frames (H, W, 3) of the video at the size of the picture.
    points : (T, N, 2)
        Landmarks and ring in the frames, picture pixels.
    scale
        Picture pixels per video pixel.
    triangles : (F, 3)
        Of the ring and the face mesh.
    face_fill, mouth_fill
        For each texture pixel the nearest pixel of its mesh, as `tts2face.models.appearance.nearest_pixels`.
    gestures, eyes
        Gesture model and the texture pixels around the eyes; None without gestures.
    n_returning
        Frames after which the video is back at its first frame, so that such clips can be joined; None: it plays on.
    """

    appearance: Appearance
    shapes: ShapeModel
    name: str
    fps: float
    picture: Picture
    plate: FrameStore
    points: Float32Array
    scale: float
    triangles: NDArray[np.int32]
    face_fill: NDArray[np.int64]
    mouth_fill: NDArray[np.int64]
    gestures: OwnFaceGestures | None = None
    eyes: TextureSamples | None = None
    n_returning: int | None = None

    @property
    def mark(self) -> Mark:
        """Mark of every written file: the talker's name and that the frames are synthetic."""
        return person_mark(self.name)

    @property
    def channels(self) -> tuple[str, ...]:
        """Motion channels: speech parameters, appearance parameters, and gestures if any."""
        speech = tuple(f"shape{i}" for i in range(self.shapes.n_speech)) + self.appearance.channels
        return speech if self.gestures is None else speech + self.gestures.channels

    @property
    def n_spoken(self) -> int:
        """Number of speech and appearance channels."""
        return self.shapes.n_speech + len(self.appearance.channels)

    def frames(
        self, clip: Clip, numbers: Iterable[int] | None = None, *, threads: int | None = None, first: int = 0
    ) -> Iterator[NDArray[np.uint8]]:
        """Pictures (H, W, 3) of a clip's frames; frame i shows the video at ``(first + i) / fps`` seconds.

        Raises
        ------
        InputError
            The clip's motion is not in the channels of this face.
        """
        values = self._motion(clip)
        instants = self._positions(first + np.arange(len(values)), clip.fps) / clip.fps

        def draw_one(number: int) -> NDArray[np.uint8]:
            return draw_video_frame(self, values[number], self.plate_frame(float(instants[number])))

        yield from map_in_order(draw_one, range(len(instants)) if numbers is None else numbers, threads)

    def frame(self, clip: Clip, number: int) -> NDArray[np.uint8]:
        """Picture (H, W, 3) of one frame of a clip."""
        position = float(self._positions(np.array([number]), clip.fps)[0])
        return draw_video_frame(self, self._motion(clip)[number], self.plate_frame(position / clip.fps))

    def with_fewest_samples(self) -> "OwnFaceRenderer":
        """The same renderer: it takes one sample a pixel."""
        return self

    def _positions(self, frames: NDArray[np.int64], fps: float) -> NDArray[np.float64]:
        """Positions in the video, in frames of the clip, at frames of the clip.

        A clip that returns turns round within its last part that is shorter than the video's way there and back.
        """
        if self.n_returning is None:
            return frames.astype(np.float64)
        last, period = self.n_returning - 1, max(2 * (len(self.plate) - 1) / self.fps * fps, 1.0)
        turn = last + last // period * period  # twice the frame at which it turns round
        return np.where(2 * frames <= turn, frames, turn - frames).astype(np.float64)

    def plate_frame(self, instant: float) -> int:
        """Index of the plate's frame at an instant in seconds; the video plays forwards and backwards in turn."""
        last = len(self.plate) - 1
        at = int(instant * self.fps + 0.5) % max(2 * last, 1)
        return min(at, 2 * last - at)

    def _motion(self, clip: Clip) -> Float32Array:
        n_channels = len(clip.motion.channels)
        if clip.motion.channels != self.channels[:n_channels] or n_channels < self.n_spoken:
            raise InputError(
                "the clip's motion is not in the channels of this talker's own face; make the clip with a session "
                "of this talker with face=self"
            )
        return np.pad(clip.motion.values, ((0, 0), (0, len(self.channels) - n_channels)))


def own_face_renderer(talker: Talker, picture: Picture, gestures: OwnFaceGestures | None = None) -> OwnFaceRenderer:
    """Renderer of a talker's own face, with gestures if given.

    Raises
    ------
    InputError
        The talker has no appearance model, or the picture has a transparent background.
    DataError
        The talker's plate cannot be decoded.
    """
    appearance = talker.appearance
    if appearance is None:
        raise InputError(
            f"the talker {talker.metadata.get('name', '')} has motion only and no own face; build it with "
            "`tts2face corpus build --appearance`"
        )
    if picture.is_transparent:
        raise InputError(
            "a talker's own face is drawn on its recorded video and cannot have a transparent background; "
            "choose a face file or another background"
        )
    if picture.size == AUTO_SIZE:
        picture = replace(picture, size=background_video_size(appearance))
    plate, scale, shift = fit_background_video(appearance, picture)
    points = ((appearance.plate.points + 0.5) * scale - 0.5 - shift).astype(np.float32)
    return OwnFaceRenderer(
        appearance=appearance,
        shapes=talker.model,
        name=str(talker.metadata.get("name", "")),
        fps=talker.fps,
        picture=picture,
        plate=plate,
        points=points,
        scale=scale,
        triangles=np.concatenate([ring_triangles(len(appearance.face.reference)), appearance.face.triangles]),
        face_fill=nearest_pixels(appearance.face),
        mouth_fill=nearest_pixels(appearance.mouth),
        gestures=gestures,
        eyes=None if gestures is None else texture_samples(appearance.face, gestures.lid_pixels > 0),
    )


def draw_video_frame(renderer: OwnFaceRenderer, motion: NDArray[np.floating], number: int) -> NDArray[np.uint8]:
    """Picture (H, W, 3) of speech, appearance and gesture channels (D,) on a frame of the plate."""
    appearance, n_speech = renderer.appearance, renderer.shapes.n_speech
    n_face, n_spoken = appearance.face.n_modes, renderer.n_spoken
    plate = appearance.plate
    n_mesh = len(appearance.face.reference)
    offset = (motion[:n_speech] - plate.shape[number, :n_speech]).astype(np.float32)
    point_offsets = np.tensordot(offset, renderer.shapes.basis[:n_speech, :n_mesh], axes=1)
    change = np.tensordot(
        (motion[n_speech : n_speech + n_face] - plate.texture_parameters[number]).astype(np.float32),
        appearance.face.basis,
        axes=1,
    )
    change *= appearance.moved_by_speech[:, None]
    if renderer.gestures is not None:
        displacement, appearance_change = renderer.gestures.displacements(motion[n_spoken:], number)
        point_offsets += displacement
        change += _lid_texture_change(renderer, number, appearance_change, float(motion[-1]))
    target = renderer.points[number].astype(np.float64)
    target[:n_mesh] += renderer.scale * (point_offsets @ plate.axes[number].T)
    mouth = appearance.mouth.textures(motion[None, n_speech + n_face : n_spoken])[0]
    textures = (
        _fill_texture(change, renderer.face_fill, appearance.face.size),
        _fill_texture(mouth, renderer.mouth_fill, appearance.mouth.size),
    )
    frame = renderer.plate[number].astype(np.float32)
    _draw_mouth_and_face(renderer, number, target, textures, frame)
    _supersample_mouth(renderer, number, target, textures, frame)
    pixels: NDArray[np.uint8] = np.clip(frame + 0.5, 0, 255).astype(np.uint8)
    return pixels


def _lid_texture_change(
    renderer: OwnFaceRenderer, number: int, appearance_change: Float32Array, closure: float
) -> Float32Array:
    """Change (P, 3) of the face texture by lids closed by a share; detail of the eye outside the model fades out."""
    face = renderer.appearance.face
    change = np.zeros((len(face.pixels), 3), np.float32)
    # lids that are not closed show the plate as it is
    if renderer.gestures is None or renderer.eyes is None or closure <= 0:
        return change
    pixels = renderer.eyes.pixels
    modelled = face.mean[pixels] + np.tensordot(
        renderer.appearance.plate.texture_parameters[number], face.basis[:, pixels], axes=1
    )
    residual = renderer.eyes.of(renderer.plate[number], renderer.points[number]) - modelled
    shut = np.tensordot(appearance_change, face.basis[:, pixels], axes=1) - closure * residual
    change[pixels] = renderer.gestures.lid_pixels[pixels, None] * shut
    return change


def _draw_mouth_and_face(
    renderer: OwnFaceRenderer,
    number: int,
    target: NDArray[np.float64],
    textures: tuple[Float32Array, Float32Array],
    frame: Float32Array,
) -> None:
    appearance, (change, mouth) = renderer.appearance, textures
    source = renderer.points[number].astype(np.float64)
    places = appearance.face.reference.astype(np.float64)
    inner, at = appearance.mouth, target[appearance.mouth_points]
    warp_image(inner.triangles, at, inner.reference, mouth, (change, places[:0]), frame)
    warp_image(renderer.triangles, target, source, renderer.plate[number], (change, places), frame)


def _supersample_mouth(
    renderer: OwnFaceRenderer,
    number: int,
    target: NDArray[np.float64],
    textures: tuple[Float32Array, Float32Array],
    frame: Float32Array,
) -> None:
    """Draw the box around the mouth again, supersampled."""
    lips = target[renderer.appearance.mouth_points]
    low = np.maximum(np.floor(lips.min(axis=0)).astype(int) - MOUTH_MARGIN_PX, 0)
    high = np.minimum(np.ceil(lips.max(axis=0)).astype(int) + MOUTH_MARGIN_PX + 1, frame.shape[1::-1])
    if (high <= low).any():
        return
    box = np.s_[low[1] : high[1], low[0] : high[0]]
    fine = np.repeat(np.repeat(frame[box], MOUTH_SUPERSAMPLING, axis=0), MOUTH_SUPERSAMPLING, axis=1)
    _draw_mouth_and_face(renderer, number, (target - low + 0.5) * MOUTH_SUPERSAMPLING - 0.5, textures, fine)
    height, width = frame[box].shape[:2]
    frame[box] = fine.reshape(height, MOUTH_SUPERSAMPLING, width, MOUTH_SUPERSAMPLING, 3).mean(axis=(1, 3))


def ring_triangles(n_mesh: int) -> NDArray[np.int32]:
    """Triangles (72, 3) between the face oval and the ring, whose point indices begin at `n_mesh`."""
    n, rows = len(FACE_OVAL), []
    for k, inner in enumerate(FACE_OVAL):
        next_inner, outer, next_outer = FACE_OVAL[(k + 1) % n], n_mesh + k, n_mesh + (k + 1) % n
        rows += [(inner, next_inner, outer), (next_inner, next_outer, outer)]
    return np.array(rows, np.int32)


def _fill_texture(texture: Float32Array, fill: NDArray[np.int64], size: tuple[int, int]) -> Float32Array:
    return np.ascontiguousarray(texture[fill].reshape(size[1], size[0], 3), np.float32)
