"""Landmarks of a head's skin and eyes alone, read in the same way of sources and targets, so that errors cancel out."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from lexicon.errors import DataError
from tts2face.interchange.characters.landmarks import CharacterViews, LocatedLandmarks, locate_landmarks
from tts2face.interchange.characters.surface import IRIS, PLAIN
from tts2face.interchange.characters.surface_points import SurfacePoints
from tts2face.interchange.characters.transfer.parts import is_kind
from tts2face.models.face import VERTEX_COLOURS, Face, keep_parts


def locate_bare_landmarks(face: Face, model: Path | None = None) -> LocatedLandmarks:
    """Landmarks of a face, read in views without hair, lashes, clothes, teeth and shapes."""
    bare = keep_parts(face, lambda part: is_kind(part.name, "skin") or is_kind(part.name, "eyes"))
    rows, corners = np.unique(bare.triangles, return_inverse=True)
    bare = replace(
        bare, vertices=face.vertices[rows], triangles=corners.reshape(-1, 3).astype(np.int32), eyes=(), shape_names=(),
        shapes=np.zeros((0, len(rows), 3), np.float32), limits=np.zeros((0, 2), np.float32), occlusion=None,
        colours=face.colours[rows], uv=None if face.uv is None else face.uv[rows], tangents=None,
        landmarks=np.zeros(0, np.int32), landmark_vertices=np.zeros((0, 3), np.int32),
        landmark_weights=np.zeros((0, 3), np.float32),
    )  # fmt: skip
    located = locate_landmarks(CharacterViews(bare, model))
    if located is None:
        raise DataError(
            "the head's face is recognised in fewer than half of its pictures, as an animal's is, to which shapes are "
            "not carried over; if it is a human's, give the axis that it looks along with --front, or the positions of "
            "its landmarks with --landmarks"
        )
    return replace(
        located, points=SurfacePoints(rows[located.points.vertices].astype(np.int64), located.points.weights)
    )


def without_colours(face: Face) -> Face:
    """Face in the plain colours that imported faces without colours have."""
    colours = np.full((len(face.vertices), 3), PLAIN["skin"], np.uint8)
    for part in face.parts:
        if is_kind(part.name, "eyes"):
            corners = face.triangles[part.first : part.first + part.count]
            colours[corners] = IRIS if part.name == "iris" else PLAIN["eyes"]
    parts = tuple(replace(part, texture=VERTEX_COLOURS, kind="plain", cutout=False) for part in face.parts)
    return replace(face, colours=colours, uv=None, textures=(), tangents=None, parts=parts)
