"""Head of a character as one mesh with the shapes of a face: oriented, cropped, eyeballs found."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.interchange.characters.character import Character, MaterialPiece, MorphTarget
from tts2face.interchange.characters.cutting import cut_triangles
from tts2face.interchange.characters.shapes import ShapeMapping, ShapeSource
from tts2face.numeric.arrays import FloatArray, IntArray, ordered_product, smoothstep

MOVED_SHARE = 0.1  # of a shape's largest displacement: vertices that it clearly moves
# Of the height from the face's lowest point to the top of the head, by which pictures are framed: what is kept below,
# and on each side of the middle. Upright pictures show as much of the bust, and wide ones of the shoulders.
BUST_SHARE, WIDTH_SHARE = 0.8, 1.8
BLEND_SHARE = 0.03  # of the height of the moved face: half width of the blend between two halves of a divided shape
LEFT_EYE, RIGHT_EYE = 1, 2  # values of `HeadMesh.eye_of`


@dataclass(frozen=True, slots=True, eq=False)
class HeadMesh:
    """Mesh of a head in the units of its file: x to the character's left, y up, z out of the face.

    Parameters
    ----------
    vertices, triangles : (V, 3), (F, 3)
    piece_of : (F,)
        Index of the character's piece that each triangle belongs to.
    uv, colours : (V, 2), (V, 3)
        NaN for vertices without texture coordinates; linear light.
    shapes
        Displacement (V, 3) of each shape of the face at weight 1.
    bones, eye_of : (V,)
        Node that each vertex follows; 0, `LEFT_EYE` or `RIGHT_EYE`.
    turn : (3, 3)
        Rotation from the file's axes to these.
    kind_of : (F,)
        Kind of each triangle where places tell it; None where the names of the pieces do.
    """

    vertices: FloatArray
    triangles: IntArray
    piece_of: IntArray
    uv: FloatArray
    colours: FloatArray
    shapes: Mapping[str, NDArray[np.float32]]
    bones: IntArray
    eye_of: NDArray[np.int8]
    turn: FloatArray
    kind_of: NDArray[np.str_] | None = None

    def keep(self, is_kept: NDArray[np.bool_]) -> "HeadMesh":
        """Mesh with the triangles (F,) that are kept and the vertices that they use."""
        triangles = self.triangles[is_kept]
        used, corners = np.unique(triangles, return_inverse=True)
        kept = replace(self, triangles=corners.reshape(-1, 3), piece_of=self.piece_of[is_kept])
        kinds = None if self.kind_of is None else self.kind_of[is_kept]
        return replace(kept, kind_of=kinds).take(used)

    def cut(self, heights: FloatArray) -> "HeadMesh":
        """Mesh cut along a plane: the part where the heights (V,) of its vertices above the plane are not negative."""
        cut = cut_triangles(self.triangles, heights)

        def extended(values: NDArray[Any]) -> NDArray[Any]:
            there = values[cut.upper] + cut.share[:, None] * (values[cut.lower] - values[cut.upper])
            return np.concatenate([values, there.astype(values.dtype)])

        whole = replace(
            self,
            vertices=extended(self.vertices),
            triangles=cut.triangles,
            piece_of=self.piece_of[cut.source],
            uv=extended(self.uv),
            colours=extended(self.colours),
            shapes={name: extended(shape) for name, shape in self.shapes.items()},
            bones=np.concatenate([self.bones, self.bones[cut.upper]]),
            eye_of=np.concatenate([self.eye_of, self.eye_of[cut.upper]]),
        )
        return whole.keep(np.ones(len(cut.triangles), bool))

    def order_eyes_last(self) -> "HeadMesh":
        """Mesh whose vertices of the left and then of the right eyeball are the last."""
        order = np.argsort(self.eye_of, kind="stable")
        rank = np.zeros(len(order), np.int64)
        rank[order] = np.arange(len(order))
        return replace(self, triangles=rank[self.triangles]).take(order)

    def take(self, rows: IntArray) -> "HeadMesh":
        """Mesh with these vertices; its triangles are not changed."""
        return replace(
            self,
            vertices=self.vertices[rows],
            uv=self.uv[rows],
            colours=self.colours[rows],
            shapes={name: shape[rows] for name, shape in self.shapes.items()},
            bones=self.bones[rows],
            eye_of=self.eye_of[rows],
        )


def build_head_mesh(character: Character, mapping: ShapeMapping, yaw_deg: float) -> HeadMesh:
    """Head of a character, turned by `yaw_deg` about the vertical axis so that it looks along z."""
    angle = np.radians(yaw_deg)
    turn = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]]).round(12)
    whole = join_pieces(character, mapping, turn)
    low, high = moved_box(whole)
    head = crop_head(whole, low, high)
    return divide_sides(head, mapping, BLEND_SHARE * float(high[1] - low[1]))


def crop_head(whole: HeadMesh, low: FloatArray, high: FloatArray) -> HeadMesh:
    """Head and bust of a character whose face has these corners (3,)."""
    middle = (low[0] + high[0]) / 2
    above = np.abs(whole.vertices[:, 0] - middle) < high[1] - low[1]  # no raised arms
    height = whole.vertices[above, 1].max() - low[1]
    lowest = low[1] - BUST_SHARE * height
    head = whole.keep((whole.vertices[:, 1] >= lowest)[whole.triangles].any(axis=1))
    head = head.cut(head.vertices[:, 1] - lowest)
    for side in (1, -1):
        head = head.cut(WIDTH_SHARE * height - side * (head.vertices[:, 0] - middle))
    return head


def moved_box(head: HeadMesh) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest corner (3,) of the vertices that the shapes of the face move."""
    moved = np.zeros(len(head.vertices), bool)
    for shape in head.shapes.values():
        length = np.linalg.norm(shape, axis=1)
        moved |= length > max(MOVED_SHARE * float(length.max(initial=0.0)), 1e-12)
    if moved.sum() < 3:
        raise DataError("no shape moves the character's mesh; give the names of its shapes with --mapping")
    places = head.vertices[moved]
    return places.min(axis=0), places.max(axis=0)


def mapped_targets(character: Character, mapping: ShapeMapping) -> set[MorphTarget]:
    """Morph targets that the shapes of a mapping use; their weights are 0 at rest, whatever the file's defaults are."""
    sources = (source for sources in mapping.values() for source in sources)
    return {target for source in sources for target in source_weights(character, source)}


def source_weights(character: Character, source: ShapeSource) -> Mapping[MorphTarget, float]:
    """Weights of the morph targets that a source names: targets of this name, otherwise a VRM expression."""
    named = {target: source.gain for target, name in character.target_names.items() if name == source.name}
    if named:
        return named
    binds = character.expressions.get(source.name, {})
    return {target: source.gain * weight for target, weight in binds.items()}


def divide_sides(head: HeadMesh, mapping: ShapeMapping, blend: float) -> HeadMesh:
    """Head whose shapes of one side move that half of the face only; `blend` is half the width of the transition."""
    low, high = moved_box(head)
    left = smoothstep(head.vertices[:, 0] - (low[0] + high[0]) / 2, -blend, blend)[:, None].astype(np.float32)
    shapes = dict(head.shapes)
    for name, shape in head.shapes.items():
        side = next((source.side for source in mapping[name] if source.side), "")
        if side:
            shapes[name] = shape * (left if side == "Left" else 1 - left)
    return replace(head, shapes=shapes)


def join_pieces(character: Character, mapping: ShapeMapping, turn: FloatArray) -> HeadMesh:
    """All pieces of a character as one mesh in turned axes, with the shapes of a mapping."""
    pieces = character.pieces
    starts = np.cumsum([0, *(len(piece.vertices) for piece in pieces)])
    weights = {shape: [source_weights(character, source) for source in sources] for shape, sources in mapping.items()}
    shapes: dict[str, NDArray[np.float32]] = {}
    turned = turn.T.astype(np.float32)
    for shape, sources in weights.items():
        moved = [_displacement(piece, sources) for piece in pieces]
        if any(part is not None for part in moved):
            zeros = [np.zeros(piece.vertices.shape, np.float32) for piece in pieces]
            parts = [zero if part is None else part for part, zero in zip(moved, zeros, strict=True)]
            shapes[shape] = ordered_product(np.concatenate(parts), turned).astype(np.float32, copy=False)
    driven = mapped_targets(character, mapping)
    return HeadMesh(
        vertices=ordered_product(np.concatenate([_at_rest(piece, driven) for piece in pieces]), turn.T),
        triangles=np.concatenate([piece.triangles + start for piece, start in zip(pieces, starts, strict=False)]),
        piece_of=np.repeat(np.arange(len(pieces)), [len(piece.triangles) for piece in pieces]),
        uv=np.concatenate(
            [np.full((len(piece.vertices), 2), np.nan) if piece.uv is None else piece.uv for piece in pieces]
        ),
        colours=np.concatenate(
            [np.ones(piece.vertices.shape) if piece.colours is None else piece.colours for piece in pieces]
        ),
        shapes=shapes,
        bones=np.concatenate([piece.bones for piece in pieces]),
        eye_of=np.zeros(int(starts[-1]), np.int8),
        turn=turn,
    )


def _at_rest(piece: MaterialPiece, driven: set[MorphTarget]) -> FloatArray:
    """Vertices (N, 3) of a piece with weights of 0 of the driven targets."""
    vertices = piece.vertices
    for target in driven & piece.defaults.keys() & piece.morphs.keys():
        vertices = vertices - piece.defaults[target] * piece.morphs[target]
    return vertices


def _displacement(piece: MaterialPiece, sources: list[Mapping[MorphTarget, float]]) -> NDArray[np.float32] | None:
    used = [
        (weight, piece.morphs[target])
        for source in sources
        for target, weight in source.items()
        if target in piece.morphs and weight
    ]
    if not used:
        return None
    moved = np.zeros(piece.vertices.shape, np.float32)
    for weight, morph in used:
        moved += np.float32(weight) * morph
    return moved
