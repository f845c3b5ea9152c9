"""Surfaces of an exported head: one for each part with its own material, with its own vertices."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Face, FacePart
from tts2face.models.hair import HAIR_PART
from tts2face.numeric.arrays import decode_srgb

# glTF counts in metres
MM_PER_M = 1000.0
HAIR_REFLECTION = 0.25  # cards or locks as smooth as glass turn grey in light from all sides; fibres do not
OPPOSITE = "Minus"  # ending of the name of a target for negative weights


@dataclass(frozen=True, slots=True, eq=False)
class ExportSurface:
    """Surface of the parts of one name.

    Parameters
    ----------
    part
        Material.
    vertices : (n,)
        Indices of its vertices in the face.
    triangles : (F, 3)
        Indices into `vertices`.
    """

    part: FacePart
    vertices: NDArray[np.int64]
    triangles: NDArray[np.int64]


def divide_surface(face: Face) -> list[ExportSurface]:
    """Surfaces of a face, those of equal names and materials merged."""
    spans: dict[tuple[object, ...], list[FacePart]] = {}
    for part in face.parts:
        material = (part.name, part.specular, part.shininess, part.wrap, part.opacity, part.texture, part.cutout)
        spans.setdefault(material, []).append(part)
    surfaces = []
    for parts in spans.values():
        triangles = np.concatenate([face.triangles[part.first : part.first + part.count] for part in parts])
        if not len(triangles):
            continue
        vertices, corners = np.unique(triangles, return_inverse=True)
        surfaces.append(ExportSurface(parts[0], vertices.astype(np.int64), corners.reshape(-1, 3).astype(np.int64)))
    return surfaces


@dataclass(frozen=True, slots=True, eq=False)
class MorphTargets:
    """Exported shapes, whose weights are 0 to 1 within the limits of the face.

    Modes of gestures have weights of both signs up to 35, in mm, while many programs clamp weights at 0: such a channel
    has a second target for its negative weights.

    Parameters
    ----------
    names, channels : (M,)
        Name and channel of each target.
    scales : (M,)
        Weight of the channel at which the target has weight 1; negative for a second target.
    is_half : (M,)
        Whether the target moves in one of two directions of its channel.
    """

    names: tuple[str, ...]
    channels: NDArray[np.int64]
    scales: NDArray[np.float32]
    is_half: NDArray[np.bool_]

    def weights(self, motion: NDArray[np.float32]) -> NDArray[np.float32]:
        """Weights (T, M) of the targets from motion (T, K)."""
        scaled = motion[:, self.channels] / self.scales
        return np.where(self.is_half, np.maximum(scaled, 0.0), scaled).astype(np.float32)

    def displacements(self, face: Face, vertices: NDArray[np.int64]) -> Iterator[NDArray[np.float32]]:
        """Yield the displacement (n, 3) in mm of some vertices by each target at weight 1."""
        for channel, scale in zip(self.channels, self.scales, strict=True):
            yield face.shapes[channel, vertices] * scale


def morph_targets(face: Face, channels: tuple[str, ...]) -> MorphTargets:
    """Targets of the first shapes of a face, which are the channels of a clip."""
    rows = []
    for at, (name, (low, high)) in enumerate(zip(channels, face.limits[: len(channels)].tolist(), strict=True)):
        rows.append((name, at, max(high, 1.0), low < 0))
        # a shape that goes both ways gets a second target: Blender clamps weights to 0 to 1 (decision 075)
        if low < 0:
            rows.append((f"{name}{OPPOSITE}", at, -max(-low, 1.0), True))
    return MorphTargets(
        names=tuple(row[0] for row in rows),
        channels=np.array([row[1] for row in rows], np.int64),
        scales=np.array([row[2] for row in rows], np.float32),
        is_half=np.array([row[3] for row in rows], bool),
    )


def vertex_normals(face: Face) -> NDArray[np.float32]:
    """Unit normals (V, 3) at rest, weighted by area; equal on both sides of a seam of the texture."""
    a, b, c = (face.vertices[corner].astype(np.float64) for corner in face.triangles.T)
    flat = np.cross(b - a, c - a)
    part_of = np.repeat(np.arange(len(face.parts)), [part.count for part in face.parts])
    vertex_part = np.zeros(len(face.vertices), np.int64)
    vertex_part[face.triangles.ravel()] = np.repeat(part_of, 3)
    key = np.column_stack([np.rint(face.vertices * 1000).astype(np.int64), vertex_part])
    _, weld = np.unique(key, axis=0, return_inverse=True)
    weld = weld.ravel()
    corners = weld[face.triangles.ravel()]
    summed = np.column_stack(
        [np.bincount(corners, np.repeat(flat[:, axis], 3), int(weld.max()) + 1) for axis in range(3)]
    )
    length = np.linalg.norm(summed, axis=1, keepdims=True)
    unit = np.where(length > 0, summed / np.where(length > 0, length, 1), [0.0, 0.0, 1.0])
    return unit[weld].astype(np.float32)


def linear_colours(face: Face) -> NDArray[np.float64]:
    """Linear light (V, 3) in [0, 1] of the vertex colours (IEC 61966-2-1)."""
    colours: NDArray[np.float64] = decode_srgb(np.arange(256) / 255.0)[face.colours]
    return colours


def roughness(part: FacePart) -> float:
    """Roughness in [0, 1] of a Blinn-Phong exponent: the fourth root of 2 / (n + 2) (Karis 2013)."""
    return float((2.0 / (part.shininess + 2.0)) ** 0.25)


def reflection(part: FacePart) -> float:
    """Share of the white light that a smooth surface of glass reflects."""
    return 0.0 if not part.specular else HAIR_REFLECTION if part.name == HAIR_PART else 1.0


def texture_jpeg(texture: NDArray[np.uint8]) -> bytes:
    """A texture (H, W, 3) as JPEG."""
    return _encoded(texture, "JPEG", quality=95, subsampling=0)


def texture_png(texture: NDArray[np.uint8], alpha: NDArray[np.uint8] | None = None) -> bytes:
    """A texture (H, W, 3), with its coverage (H, W) if it has one, as PNG."""
    return _encoded(texture if alpha is None else np.dstack([texture, alpha]), "PNG", compress_level=3)


def _encoded(pixels: NDArray[np.uint8], kind: str, **options: Any) -> bytes:
    import io

    from PIL import Image

    content = io.BytesIO()
    Image.fromarray(pixels).save(content, kind, **options)
    return content.getvalue()
