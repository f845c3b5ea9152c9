"""Linear face model with everything needed to draw it, and the selection of its parts."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.models.codec import Stored, StoredModel
from tts2face.models.light import Lamps, Light, Photographed
from tts2face.models.mesh_coding import TANGENTS, UV
from tts2face.models.score_map import ScoreMap
from tts2face.numeric.arrays import make_read_only
from tts2face.storage.marks import Mark
from tts2face.storage.schema import Tensor, millimetres

PART_KINDS = ("plain", "skin", "eye", "strands")
MAX_WEIGHT = 100.0  # of a shape; common shapes have 0 to 1, gesture modes up to about 30
SUM_WITHIN = 1e-3  # tolerance of the sum of barycentric weights; 32-bit rounding is 1e-7
LIMITS = Tensor("float32", ("shapes", 2), -MAX_WEIGHT, MAX_WEIGHT, may_be_empty=True)
BARYCENTRIC = Tensor("float32", ("landmarks", 3), -SUM_WITHIN, 1 + SUM_WITHIN, may_be_empty=True)
VERTEX_COLOURS = -1  # `FacePart.texture` of a part without texture
WIDE_OPEN = "jawOpen"  # opens the mouth of faces with ARKit's shapes


@dataclass(frozen=True, slots=True, eq=False)
class Texture:
    """Texture of a face: ``pixels`` (H, W, 3), sRGB, and their coverage ``alpha`` (H, W), 0-255, or None if opaque."""

    pixels: NDArray[np.uint8]
    alpha: NDArray[np.uint8] | None = None

    def __post_init__(self) -> None:
        """Check that the arrays agree, then make them read-only."""
        if self.pixels.ndim != 3 or self.pixels.shape[2] != 3:
            raise DataError(
                f"a texture has the shape {self.pixels.shape}, not (height, width, 3); build the face again"
            )
        if self.alpha is not None and self.alpha.shape != self.pixels.shape[:2]:
            raise DataError("a texture and its alpha differ in size; build the face again")
        make_read_only(self)


@dataclass(frozen=True, slots=True)
class Hairdo:
    """Haircut and hair colour of a face: names of `tts2face.haircuts` and `tts2face.hair_colours`, or #rrggbb."""

    haircut: str
    colour: str


@dataclass(frozen=True, slots=True)
class FacePart:
    """Named part of the surface with one material: the triangles [first, first + count) of the face.

    ``specular`` is the strength of the highlight (0 = matt), ``shininess`` its Blinn-Phong exponent, ``wrap`` the wrap
    of diffuse light around the shape (0 = hard, 1 = very soft, an approximation of subsurface scattering), ``opacity``
    is in (0, 1]. ``texture`` is the number of the face's texture that gives the colour, `VERTEX_COLOURS` for none;
    ``cutout`` parts are drawn where the texture's alpha is. ``kind`` selects the shading: plain, skin, eye, or strands
    (hair cards, whose highlights follow `Face.tangents`).
    """

    name: str
    first: int
    count: int
    specular: float = 0.0
    shininess: float = 16.0
    wrap: float = 0.0
    opacity: float = 1.0
    texture: int = VERTEX_COLOURS
    cutout: bool = False
    kind: str = "plain"

    @property
    def is_textured(self) -> bool:
        """Whether the colour is that of a texture."""
        return self.texture != VERTEX_COLOURS


@dataclass(frozen=True, slots=True, eq=False)
class Eye:
    """Eyeball that rotates rigidly about its centre (3,), mm: the vertices [first, first + count).

    ``turns`` gives for each gaze shape (ARKit ``eyeLook...``) the rotation vector (3,), radians, at weight 1.
    """

    first: int
    count: int
    centre: NDArray[np.float32]
    turns: Mapping[str, NDArray[np.float32]]


def _optional(stored: Stored) -> Stored:
    """An array that not every face has."""
    return replace(stored, tensor=replace(stored.tensor, is_optional=True))


@dataclass(frozen=True, slots=True, eq=False, weakref_slot=True)
class Face(StoredModel):
    """A linear face model with everything needed to draw it.

    Axes: x to the face's own left, y up, z out of the face; millimetres; origin midway between the eyeball centres.

    Parameters
    ----------
    vertices : (V, 3)
        The face at rest.
    triangles : (F, 3)
        Vertex indices, counter-clockwise seen from outside, in the order of `parts`.
    parts
        Cover all triangles in order.
    shape_names, shapes : (K,), (K, V, 3)
        Named basis (ARKit-52 names); displacement in mm at weight 1.
    limits : (K, 2)
        Least and greatest plausible weight.
    eyes
        Eyeballs; gaze shapes rotate them by `Eye.turns`, not by `shapes`.
    colours : (V, 3)
        sRGB, 0-255.
    textures
        Textures of the parts; the first is the skin's.
    uv : (V, 2)
        Texture coordinates in [0, 1] from the top left corner of the texture of the vertex's part; None without.
    tangents : (V, 3)
        Unit vectors along the strands, for the vertices of parts of kind strands; None without.
    occlusion : (P, V, D / 8)
        Directions from which each vertex is hidden, as packed bits, at rest and, of two poses, with `opened_by`
        (`tts2face.picture.occlusion`); None where it is not computed.
    landmarks, landmark_vertices, landmark_weights : (L,), (L, 3), (L, 3)
        Landmark `landmarks[i]` of `tts2face.models.landmarks` lies at the barycentric weights of three vertices.
    pivot : (3,)
        The point about which the head turns.
    metadata
        Name, licence, attribution, and the command that built it.
    hairdo
        Haircut and colour that suit the face, of those that fit it; None for a face that no haircut fits.
    scores
        What the face tracker reads in the mouth for weights of the shapes that speech moves; None if unknown.
    opened_by
        Shape that opens the mouth wide, by which its light changes; a name that is none of the shapes where none does.
    lip_tolerance_mm
        By which gestures may change the gap of lips that touch; 0 where all shapes were modelled to keep them shut.
    light
        Lamps, unless the face has light of its own: that which a path tracer has baked, or that of a photograph.
    """

    vertices: Annotated[NDArray[np.float32], millimetres("vertices", 3)]
    triangles: Annotated[NDArray[np.int32], Tensor("int32", ("triangles", 3))]
    parts: tuple[FacePart, ...]
    shape_names: tuple[str, ...]
    shapes: NDArray[np.float32]
    limits: Annotated[NDArray[np.float32], LIMITS]
    eyes: tuple[Eye, ...]
    colours: Annotated[NDArray[np.uint8], Tensor("uint8", ("vertices", 3))]
    uv: Annotated[NDArray[np.float32] | None, _optional(UV)]
    textures: Sequence[Texture]
    landmarks: Annotated[NDArray[np.int32], Tensor("int32", ("landmarks",), may_be_empty=True)]
    landmark_vertices: Annotated[NDArray[np.int32], Tensor("int32", ("landmarks", 3), may_be_empty=True)]
    landmark_weights: Annotated[NDArray[np.float32], BARYCENTRIC]
    pivot: Annotated[NDArray[np.float32], millimetres(3)]
    metadata: Mapping[str, Any] = field(default_factory=dict)
    tangents: Annotated[NDArray[np.float32] | None, _optional(TANGENTS)] = None
    hairdo: Hairdo | None = None
    occlusion: NDArray[np.uint8] | None = None
    scores: ScoreMap | None = None
    opened_by: str = WIDE_OPEN
    lip_tolerance_mm: float = 0.0
    light: Light = field(default_factory=Lamps)

    @property
    def mark(self) -> Mark:
        """Mark of files that show the face."""
        is_of_person = "consent" in self.metadata
        unnamed = "a person" if is_of_person or self.light.is_flat else ""
        return self.light.mark(str(self.metadata.get("name") or unnamed), is_of_person=is_of_person)

    @property
    def opening(self) -> int | None:
        """Number of the shape `opened_by`; None for a face that has none."""
        return self.shape_names.index(self.opened_by) if self.opened_by in self.shape_names else None

    @property
    def n_lit_poses(self) -> int:
        """Poses with an occlusion of their own: that of the face where it is stored, shapes may be added later."""
        return len(self.occlusion) if self.occlusion is not None else 1 + (self.opening is not None)

    def __post_init__(self) -> None:
        """Check that the arrays agree, then make them read-only."""
        n_vertices, n_shapes = len(self.vertices), len(self.shape_names)
        fits = (
            self.vertices.shape == (n_vertices, 3)
            and self.shapes.shape == (n_shapes, n_vertices, 3)
            and self.limits.shape == (n_shapes, 2)
            and self.colours.shape == (n_vertices, 3)
            and (self.uv is None or self.uv.shape == (n_vertices, 2))
            and self.landmark_vertices.shape == self.landmark_weights.shape == (len(self.landmarks), 3)
            and (self.tangents is None or self.tangents.shape == (n_vertices, 3))
            and (self.occlusion is None or self.occlusion.shape[1] == n_vertices)
            and (not isinstance(self.light, Photographed) or self.light.view.follow.shape == (n_vertices,))
            and (self.uv is not None or not self.textures)
            and all(part.texture < len(self.textures) for part in self.parts)
            and sum(part.count for part in self.parts) == len(self.triangles)
        )
        if not fits:
            raise DataError("the face's vertices, shapes, colours and landmarks do not fit each other; build it again")
        if self.n_lit_poses > 1 and self.opening is None:
            raise DataError(
                f"the face's occlusion is for the shape {self.opened_by!r}, which it lacks; leave that out, too"
            )
        if self.triangles.size and not 0 <= int(self.triangles.min()) <= int(self.triangles.max()) < n_vertices:
            raise DataError(
                f"a triangle of the face has a vertex index beyond its {n_vertices} vertices; build it again"
            )
        make_read_only(self)


def keep_parts(face: Face, is_kept: Callable[[FacePart], bool]) -> Face:
    """A face with the triangles of some of its parts; its vertices stay, so that landmarks and eyes hold.

    Lamps light it: light of its own belongs to all parts.
    """
    kept = [part for part in face.parts if is_kept(part)]
    firsts = accumulate((part.count for part in kept), initial=0)  # one more than there are parts
    parts = tuple(replace(part, first=first) for part, first in zip(kept, firsts, strict=False))
    triangles = [face.triangles[part.first : part.first + part.count] for part in kept]
    return replace(face, parts=parts, triangles=np.concatenate([np.zeros((0, 3), np.int32), *triangles]), light=Lamps())
