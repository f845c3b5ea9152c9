"""A talker's own face, near photoreal: her plate bent to the speech, the change of her looks laid over it.

The face model's mean and fine detail cancel out: what is drawn is the plate's own picture, moved with the landmarks,
plus the difference between the looks of speech and those of the plate. No edge is ever cut, so there is no seam. Only
the inside of the mouth comes from its model alone. The ring around the face gives way to the chin.
"""

import io
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.models.appearance import Appearance, Plate, nearest_pixels
from tts2face.models.landmarks import FACE_OVAL
from tts2face.models.talker import ShapeModel, Talker
from tts2face.own_face.gestures import OwnFaceGestures
from tts2face.prefetch import map_in_order
from tts2face.render.image_warp import draw_texture, warp_image
from tts2face.render.picture import AUTO_SIZE, SIDE_LIMITS_PX, Picture
from tts2face.render.plate_sampling import TextureSamples, texture_samples
from tts2face.render.renderer import SYNTHETIC_NOTICE
from tts2face.render.scene import available_cores
from tts2face.types import Clip

if TYPE_CHECKING:
    from PIL.Image import Image as Drawn

MOUTH_SUPERSAMPLING = 3  # samples along a pixel's side about the mouth, where the lips' edge is drawn
MAX_RAW_BYTES = 400_000_000  # of frames kept as they are: 250 of 720 x 740
FRAME_JPEG_QUALITY = 95
MOST_VIDEO_SIDE = 8192  # px: a picture of 200 MB
MOUTH_MARGIN_PX = 3  # pixels around the mouth that are drawn finely
Float32Array = NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class OwnFaceRenderer:
    """Draws a talker's own face on the talker's own video; a `tts2face.render.renderer.FrameRenderer`.

    ``plate`` are T frames (H, W, 3) at the size of the picture, ``points`` (T, N, 2) in them, ``scale`` picture pixels
    for one of the video; the textures' pixels are filled beyond their meshes from ``face_fill`` and ``mouth_fill``.
    """

    appearance: Appearance
    shapes: ShapeModel
    name: str
    fps: float
    picture: Picture
    plate: "FrameStore"
    points: Float32Array
    scale: float
    triangles: NDArray[np.int32]
    face_fill: NDArray[np.int64]
    mouth_fill: NDArray[np.int64]
    gestures: OwnFaceGestures | None = None
    eyes: TextureSamples | None = None

    @property
    def notice(self) -> str:
        """What every file of it says about itself."""
        return SYNTHETIC_NOTICE.format(name=self.name)

    @property
    def channels(self) -> tuple[str, ...]:
        """Channels of the motion that it draws: the talker's speech parameters, her looks, and gestures if any."""
        spoken = tuple(f"shape{i}" for i in range(self.shapes.n_speech)) + self.appearance.channels
        return spoken if self.gestures is None else spoken + self.gestures.channels

    @property
    def n_spoken(self) -> int:
        """Number of channels of speech and appearance."""
        return self.shapes.n_speech + len(self.appearance.channels)

    def frames(self, clip: Clip, *, threads: int | None = None, first: int = 0) -> Iterator[NDArray[np.uint8]]:
        """Pictures (H, W, 3) of a clip's frames; the video goes on from the clip's first frame in the whole."""
        values = self._motion(clip)
        instants = (first + np.arange(len(values))) / clip.fps

        def draw_one(number: int) -> NDArray[np.uint8]:
            return draw_video_frame(self, values[number], self.plate_frame(float(instants[number])))

        yield from map_in_order(draw_one, range(len(instants)), threads or available_cores())

    def frame(self, clip: Clip, number: int) -> NDArray[np.uint8]:
        """The picture of one frame of a clip."""
        return draw_video_frame(self, self._motion(clip)[number], self.plate_frame(number / clip.fps))

    def plate_frame(self, instant: float) -> int:
        """The plate's frame at an instant in seconds: to the end, back to the beginning, and again."""
        last = len(self.plate) - 1
        at = int(instant * self.fps + 0.5) % max(2 * last, 1)
        return min(at, 2 * last - at)

    def _motion(self, clip: Clip) -> Float32Array:
        n_moved = len(clip.motion.channels)
        if clip.motion.channels != self.channels[:n_moved] or n_moved < self.n_spoken:
            raise InputError(
                "the clip's motion is not in the channels of this talker's own face; make the clip with a session of it"
            )
        return np.pad(clip.motion.values, ((0, 0), (0, len(self.channels) - n_moved)))


def own_face_renderer(talker: Talker, picture: Picture, gestures: OwnFaceGestures | None = None) -> OwnFaceRenderer:
    """The renderer of a talker's own face; with `gestures` it draws theirs too.

    Raises
    ------
    InputError
        The talker has motion only, or the picture asks for what a plate does not have.
    """
    appearance = talker.appearance
    if appearance is None:
        raise InputError(
            f"the talker {talker.metadata.get('name', '')} has motion only; `tts2face corpus build --appearance` makes "
            "one that shows her own face"
        )
    if picture.is_transparent:
        raise InputError(
            "a talker's own face is drawn on her own video; choose a face file for a transparent background"
        )
    if picture.size == AUTO_SIZE:
        picture = replace(picture, size=_background_video_size(appearance))
    plate, scale, shift = _fit_background_video(appearance, picture)
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


def draw_video_frame(stage: OwnFaceRenderer, motion: NDArray[np.floating], number: int) -> NDArray[np.uint8]:
    """One picture (H, W, 3): speech parameters, looks and gestures (D,) on a frame of the plate."""
    appearance, n_speech = stage.appearance, stage.shapes.n_speech
    n_face, n_spoken = appearance.face.n_modes, stage.n_spoken
    plate = appearance.plate
    n_mesh = len(appearance.face.reference)
    offset = (motion[:n_speech] - plate.shape[number, :n_speech]).astype(np.float32)
    moved = np.tensordot(offset, stage.shapes.basis[:n_speech, :n_mesh], axes=1)
    change = np.tensordot(
        (motion[n_speech : n_speech + n_face] - plate.looks[number]).astype(np.float32), appearance.face.basis, axes=1
    )
    change *= appearance.moved_by_speech[:, None]
    if stage.gestures is not None:
        felt, looks = stage.gestures.displacements(motion[n_spoken:], number)
        moved += felt
        change += _lid_texture_change(stage, number, looks, float(motion[-1]))
    target = stage.points[number].astype(np.float64)
    target[:n_mesh] += stage.scale * (moved @ plate.axes[number].T)
    mouth = appearance.mouth.textures(motion[None, n_speech + n_face : n_spoken])[0]
    textures = (
        _fill_texture(change, stage.face_fill, appearance.face.size),
        _fill_texture(mouth, stage.mouth_fill, appearance.mouth.size),
    )
    frame = stage.plate[number].astype(np.float32)
    _draw_mouth_and_face(stage, number, target, textures, frame)
    _draw_mouth_finely(stage, number, target, textures, frame)
    drawn: NDArray[np.uint8] = np.clip(frame + 0.5, 0, 255).astype(np.uint8)
    return drawn


def _lid_texture_change(stage: OwnFaceRenderer, number: int, looks: Float32Array, share: float) -> Float32Array:
    """(P, 3) change of the face's texture by lids shut by a share: what the model does not know of the eye fades."""
    face = stage.appearance.face
    change = np.zeros((len(face.pixels), 3), np.float32)
    if stage.gestures is None or stage.eyes is None or share <= 0:
        return change
    here = stage.eyes.pixels
    known = face.mean[here] + np.tensordot(stage.appearance.plate.looks[number], face.basis[:, here], axes=1)
    own = stage.eyes.of(stage.plate[number], stage.points[number]) - known
    shut = np.tensordot(looks, face.basis[:, here], axes=1) - share * own
    change[here] = stage.gestures.lid_pixels[here, None] * shut
    return change


def _draw_mouth_and_face(
    stage: OwnFaceRenderer,
    number: int,
    target: NDArray[np.float64],
    textures: tuple[Float32Array, Float32Array],
    frame: Float32Array,
) -> None:
    appearance, (change, mouth) = stage.appearance, textures
    source = stage.points[number].astype(np.float64)
    places = appearance.face.reference.astype(np.float64)
    draw_texture(appearance.mouth.triangles, target[appearance.mouth_points], mouth, appearance.mouth.reference, frame)
    warp_image(stage.triangles, target, source, stage.plate[number], (change, places), frame)


def _draw_mouth_finely(
    stage: OwnFaceRenderer,
    number: int,
    target: NDArray[np.float64],
    textures: tuple[Float32Array, Float32Array],
    frame: Float32Array,
) -> None:
    """Draw the box around the mouth again with more samples, and their mean."""
    lips = target[stage.appearance.mouth_points]
    low = np.maximum(np.floor(lips.min(axis=0)).astype(int) - MOUTH_MARGIN_PX, 0)
    high = np.minimum(np.ceil(lips.max(axis=0)).astype(int) + MOUTH_MARGIN_PX + 1, frame.shape[1::-1])
    if (high <= low).any():
        return
    box = np.s_[low[1] : high[1], low[0] : high[0]]
    fine = np.repeat(np.repeat(frame[box], MOUTH_SUPERSAMPLING, axis=0), MOUTH_SUPERSAMPLING, axis=1)
    _draw_mouth_and_face(stage, number, (target - low + 0.5) * MOUTH_SUPERSAMPLING - 0.5, textures, fine)
    height, width = frame[box].shape[:2]
    frame[box] = fine.reshape(height, MOUTH_SUPERSAMPLING, width, MOUTH_SUPERSAMPLING, 3).mean(axis=(1, 3))


class FrameStore:
    """Pictures (H, W, 3) by number; as JPEG files where they would take much memory."""

    def __init__(self, pictures: "Iterable[Drawn]") -> None:
        self._raw: list[NDArray[np.uint8]] = []
        self._packed: list[bytes] = []
        for picture in pictures:
            if sum(map(np.size, self._raw)) < MAX_RAW_BYTES:
                self._raw.append(np.asarray(picture))
            else:
                store = io.BytesIO()
                picture.save(store, "JPEG", quality=FRAME_JPEG_QUALITY, subsampling=0)
                self._packed.append(store.getvalue())

    def __len__(self) -> int:
        """Count the pictures."""
        return len(self._raw) + len(self._packed)

    def __getitem__(self, number: int) -> NDArray[np.uint8]:
        """The picture of this number."""
        from PIL import Image

        if number < len(self._raw):
            return self._raw[number]
        return np.asarray(Image.open(io.BytesIO(self._packed[number - len(self._raw)])))


def _background_video_size(appearance: Appearance) -> str:
    """The size of the talker's video, within what can be drawn."""
    height, width = next(_decode_video(appearance.plate)).shape[:2]
    scale = min(1.0, SIDE_LIMITS_PX[1] / max(height, width))
    return "x".join(str(max(int(side * scale) // 2 * 2, SIDE_LIMITS_PX[0])) for side in (width, height))


def _fit_background_video(appearance: Appearance, picture: Picture) -> tuple[FrameStore, float, NDArray[np.float64]]:
    """The plate's frames scaled to fill the picture, the face in its middle where the video reaches so far.

    Returns the frames, the scale, and the scaled place of their left top corner.
    """
    from PIL import Image

    height, width = next(_decode_video(appearance.plate)).shape[:2]
    scale = max(picture.width / width, picture.height / height)
    middle = (appearance.plate.points.mean(axis=(0, 1)) + 0.5) * scale
    room = np.array([width * scale - picture.width, height * scale - picture.height])
    shift = np.clip(middle - np.array([picture.width, picture.height]) / 2, 0.0, np.maximum(room, 0.0))
    sides = picture.width, picture.height
    left, top = (float(at) for at in shift / scale)
    box = left, top, min(left + sides[0] / scale, float(width)), min(top + sides[1] / scale, float(height))
    frames = (Image.fromarray(pixels) for pixels in _decode_video(appearance.plate))
    return FrameStore(frame.resize(sides, Image.Resampling.BICUBIC, box=box) for frame in frames), scale, shift


def _decode_video(plate: Plate) -> Iterator[NDArray[np.uint8]]:
    """Pictures of a plate's video, one for each row of its points.

    Raises
    ------
    DataError
        It cannot be decoded, its pictures are too large or change their size, or they are not as many as the points.
    """
    import av

    n_frames = 0
    try:
        with av.open(io.BytesIO(plate.video.tobytes()), "r", format="mp4", metadata_errors="replace") as container:
            stream = container.streams.video[0]
            size = stream.width, stream.height
            for frame in container.decode(stream) if max(size) <= MOST_VIDEO_SIDE else ():
                if n_frames == len(plate.points) or (frame.width, frame.height) != size:
                    n_frames = -1
                    break
                n_frames += 1
                yield frame.to_ndarray(format="rgb24").astype(np.uint8, copy=False)
    except (av.FFmpegError, IndexError) as broken:
        raise DataError(f"the talker's plate cannot be decoded ({broken}); build the talker again") from broken
    if n_frames != len(plate.points):
        raise DataError(
            f"the talker's plate must show {len(plate.points)} pictures, as its points do, of one size up to "
            f"{MOST_VIDEO_SIDE} px; build the talker again"
        )


def ring_triangles(n_mesh: int) -> NDArray[np.int32]:
    """(72, 3) triangles between the oval and the ring, whose points follow the mesh's."""
    n, rows = len(FACE_OVAL), []
    for k, here in enumerate(FACE_OVAL):
        after, outer, outer_after = FACE_OVAL[(k + 1) % n], n_mesh + k, n_mesh + (k + 1) % n
        rows += [(here, after, outer), (after, outer_after, outer)]
    return np.array(rows, np.int32)


def _fill_texture(texture: Float32Array, fill: NDArray[np.int64], size: tuple[int, int]) -> Float32Array:
    return np.ascontiguousarray(texture[fill].reshape(size[1], size[0], 3), np.float32)
