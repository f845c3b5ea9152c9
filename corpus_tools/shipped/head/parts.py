"""Pieces of a head, and their assembly into a `Face`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tts2face.models.face import Eye, Face, FacePart, Texture
from tts2face.numeric.arrays import FloatArray, unit_vectors


@dataclass(frozen=True, slots=True, eq=False)
class MaterialSpan:
    """Triangles (F, 3) of one material within a piece; `material` holds the keyword arguments of `FacePart`."""

    name: str
    triangles: NDArray[np.int64]
    material: Mapping[str, Any]


@dataclass(frozen=True, slots=True, eq=False)
class HeadPart:
    """Vertices (N, 3) in mm, colours (N, 3) in 0..1, shapes by name (N, 3), texture coordinates (N, 2) or None.

    ``tangents`` (N, 3) are unit vectors along strands, or None.
    """

    vertices: FloatArray
    spans: tuple[MaterialSpan, ...]
    colours: FloatArray
    shapes: Mapping[str, FloatArray] = field(default_factory=dict)
    uv: FloatArray | None = None
    tangents: FloatArray | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Eyeball:
    """An eyeball: centre (3,), radius in mm, and its turns by gaze shape, rotation vectors (3,) in radians.

    ``iris`` and ``pupil`` are half angles seen from the centre, radians; ``bulge`` is the cornea's height in radii.
    """

    centre: FloatArray
    radius: float
    turns: Mapping[str, FloatArray]
    iris: float
    pupil: float
    bulge: float


@dataclass(frozen=True, slots=True, eq=False)
class HeadPieces:
    """The pieces of a head; pieces `eye_pieces` are the eyeballs `balls`."""

    pieces: tuple[HeadPart, ...]
    eye_pieces: tuple[int, ...]
    balls: tuple[Eyeball, ...]
    pivot: FloatArray


def stack_vertices(built: HeadPieces) -> FloatArray:
    """(V, 3) vertices of all pieces in order."""
    return np.concatenate([piece.vertices for piece in built.pieces])


def assemble_face(
    built: HeadPieces, shape_names: Sequence[str], textures: tuple[Texture, ...], metadata: Mapping[str, Any]
) -> Face:
    """The face of the pieces, without landmarks."""
    firsts = np.cumsum([0, *(len(piece.vertices) for piece in built.pieces)])
    triangles, parts = _parts(built, firsts)
    shapes = np.zeros((len(shape_names), int(firsts[-1]), 3), np.float32)
    uv, tangents = np.zeros((int(firsts[-1]), 2), np.float32), np.zeros((int(firsts[-1]), 3), np.float32)
    for first, piece in zip(firsts, built.pieces, strict=False):
        here = slice(first, first + len(piece.vertices))
        for name, moved in piece.shapes.items():
            shapes[shape_names.index(name), here] = moved
        if piece.uv is not None:
            uv[here] = piece.uv
        if piece.tangents is not None:
            tangents[here] = unit_vectors(piece.tangents)
    colours = np.concatenate([piece.colours for piece in built.pieces])
    return Face(
        vertices=stack_vertices(built).astype(np.float32),
        triangles=triangles,
        parts=tuple(parts),
        shape_names=tuple(shape_names),
        shapes=shapes,
        limits=np.tile(np.array([0.0, 1.0], np.float32), (len(shape_names), 1)),
        eyes=tuple(_eyes(built, firsts)),
        colours=np.rint(np.clip(colours, 0, 1) * 255).astype(np.uint8),
        uv=uv,
        textures=textures,
        tangents=tangents,
        landmarks=np.zeros(0, np.int32),
        landmark_vertices=np.zeros((0, 3), np.int32),
        landmark_weights=np.zeros((0, 3), np.float32),
        pivot=built.pivot.astype(np.float32),
        metadata=dict(metadata),
    )


def _parts(built: HeadPieces, firsts: NDArray[np.integer]) -> tuple[NDArray[np.int32], list[FacePart]]:
    spans = [(span, first) for first, piece in zip(firsts, built.pieces, strict=False) for span in piece.spans]
    starts = accumulate((len(span.triangles) for span, _ in spans), initial=0)
    parts = [
        FacePart(span.name, start, len(span.triangles), **span.material)
        for (span, _), start in zip(spans, starts, strict=False)
    ]
    return np.concatenate([span.triangles + first for span, first in spans]).astype(np.int32), parts


def _eyes(built: HeadPieces, firsts: NDArray[np.integer]) -> list[Eye]:
    eyes = []
    for at, ball in zip(built.eye_pieces, built.balls, strict=True):
        turns = {name: turn.astype(np.float32) for name, turn in ball.turns.items()}
        count = len(built.pieces[at].vertices)
        eyes.append(Eye(int(firsts[at]), count, ball.centre.astype(np.float32), turns))
    return eyes
