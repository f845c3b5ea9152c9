"""The plate of a talker: its frames, scaled to a picture, and their colours at the pixels of the face texture."""

import io
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.appearance import Appearance, Plate, TextureModel
from tts2face.numeric.arrays import Float32Array
from tts2face.picture.options import SIDE_LIMITS_PX, Picture
from tts2face.video.container import metadata_options

if TYPE_CHECKING:
    from PIL.Image import Image as PilImage


MAX_RAW_BYTES = 400_000_000  # of frames kept uncompressed: 250 of 720 x 740
FRAME_JPEG_QUALITY = 95
MAX_VIDEO_SIDE_PX = 8192  # a picture of 200 MB


@dataclass(frozen=True, slots=True, eq=False)
class TextureSamples:
    """Positions of some texture pixels in the mesh.

    ``pixels`` (Q,) are indices into `TextureModel.pixels`; pixel q has the barycentric ``weights`` (Q, 3) with respect
    to the mesh points ``corners`` (Q, 3).
    """

    pixels: NDArray[np.int64]
    corners: NDArray[np.int32]
    weights: Float32Array

    def of(self, picture: NDArray[np.uint8], points: NDArray[np.floating]) -> Float32Array:
        """Bilinear colours (Q, 3) of a picture (H, W, 3) whose mesh points lie at `points` (N, 2), pixels."""
        height, width = picture.shape[:2]
        places = np.einsum("qc,qcd->qd", self.weights, points[self.corners])
        # below the last pixel, so that four neighbours exist
        x, y = np.clip(places[:, 0], 0, width - 1.001), np.clip(places[:, 1], 0, height - 1.001)
        left, top = x.astype(np.int64), y.astype(np.int64)
        right, low = (x - left)[:, None], (y - top)[:, None]
        above = picture[top, left] * (1 - right) + picture[top, left + 1] * right
        below = picture[top + 1, left] * (1 - right) + picture[top + 1, left + 1] * right
        return np.asarray(above * (1 - low) + below * low, np.float32)


def texture_samples(model: TextureModel, chosen: NDArray[np.bool_]) -> TextureSamples:
    """Mesh positions of the texture pixels selected by `chosen` (P,); pixels outside all triangles are dropped."""
    pixels = np.flatnonzero(chosen)
    width = model.size[0]
    places = np.stack([model.pixels[pixels] % width, model.pixels[pixels] // width], axis=1).astype(np.float64)
    corners = np.zeros((len(pixels), 3), np.int32)
    weights = np.full((len(pixels), 3), -1.0)
    for triangle in model.triangles:
        a, b, c = model.reference[triangle].astype(np.float64)
        sides = np.column_stack([b - a, c - a])
        if abs(np.linalg.det(sides)) < 1e-9:
            continue
        along = (places - a) @ np.linalg.inv(sides).T
        barycentric = np.column_stack([1 - along.sum(axis=1), along])
        better = barycentric.min(axis=1) > weights.min(axis=1)
        corners[better], weights[better] = triangle, barycentric[better]
    inside = weights.min(axis=1) > -1e-3
    return TextureSamples(pixels[inside], corners[inside], weights[inside].astype(np.float32))


class FrameStore:
    """Pictures (H, W, 3) by index; beyond `MAX_RAW_BYTES` they are kept as JPEG."""

    def __init__(self, pictures: "Iterable[PilImage]") -> None:
        self._raw: list[NDArray[np.uint8]] = []
        self._packed: list[bytes] = []
        for picture in pictures:
            if sum(map(np.size, self._raw)) < MAX_RAW_BYTES:
                self._raw.append(np.asarray(picture))
            else:
                content = io.BytesIO()
                picture.save(content, "JPEG", quality=FRAME_JPEG_QUALITY, subsampling=0)
                self._packed.append(content.getvalue())

    def __len__(self) -> int:
        """Number of pictures."""
        return len(self._raw) + len(self._packed)

    def __getitem__(self, number: int) -> NDArray[np.uint8]:
        """Picture (H, W, 3) at an index."""
        from PIL import Image

        if number < len(self._raw):
            return self._raw[number]
        return np.asarray(Image.open(io.BytesIO(self._packed[number - len(self._raw)])))


def background_video_size(appearance: Appearance) -> str:
    """Size of the plate's video as ``WIDTHxHEIGHT``, reduced to even sides within `SIDE_LIMITS_PX`."""
    height, width = next(_decode_video(appearance.plate)).shape[:2]
    scale = min(1.0, SIDE_LIMITS_PX[1] / max(height, width))
    return "x".join(str(max(int(side * scale) // 2 * 2, SIDE_LIMITS_PX[0])) for side in (width, height))


def fit_background_video(appearance: Appearance, picture: Picture) -> tuple[FrameStore, float, NDArray[np.float64]]:
    """Frames of the plate scaled to fill the picture, with the face centred as far as the video extends.

    Returns
    -------
    frames
        One for each row of the plate's points.
    scale
        Picture pixels per video pixel.
    shift : (2,)
        Top left corner of the picture in the scaled video, picture pixels.
    """
    from PIL import Image

    height, width = next(_decode_video(appearance.plate)).shape[:2]
    scale = max(picture.width / width, picture.height / height)
    centre = (appearance.plate.points.mean(axis=(0, 1)) + 0.5) * scale
    slack = np.array([width * scale - picture.width, height * scale - picture.height])
    shift = np.clip(centre - np.array([picture.width, picture.height]) / 2, 0.0, np.maximum(slack, 0.0))
    sides = picture.width, picture.height
    left, top = (float(at) for at in shift / scale)
    box = left, top, min(left + sides[0] / scale, float(width)), min(top + sides[1] / scale, float(height))
    frames = (Image.fromarray(pixels) for pixels in _decode_video(appearance.plate))
    return FrameStore(frame.resize(sides, Image.Resampling.BICUBIC, box=box) for frame in frames), scale, shift


def _decode_video(plate: Plate) -> Iterator[NDArray[np.uint8]]:
    """Pictures (H, W, 3) of a plate's video, one for each row of its points."""
    import av

    n_frames = 0
    try:
        with av.open(io.BytesIO(plate.video.tobytes()), "r", format="mp4", **metadata_options()) as container:
            stream = container.streams.video[0]
            size = stream.width, stream.height
            for frame in container.decode(stream) if max(size) <= MAX_VIDEO_SIDE_PX else ():
                # as many frames as points, all of one size: else the file is damaged
                if n_frames == len(plate.points) or (frame.width, frame.height) != size:
                    n_frames = -1
                    break
                n_frames += 1
                yield frame.to_ndarray(format="rgb24").astype(np.uint8, copy=False)
    except (av.FFmpegError, IndexError) as error:
        raise DataError(f"the talker's plate cannot be decoded ({error}); build the talker again") from error
    if n_frames != len(plate.points):
        raise DataError(
            f"the talker's plate must show {len(plate.points)} pictures, one for each row of points, of one size up to "
            f"{MAX_VIDEO_SIDE_PX} px; build the talker again"
        )
