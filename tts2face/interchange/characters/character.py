"""Character: meshes, materials, named shapes and bones of an imported file, in the file's own units."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray, IntArray

OPAQUE = "OPAQUE"
MASK = "MASK"
BLEND = "BLEND"
STILL_SHARE = 1e-5  # of a piece's size: .003 mm of a head


@dataclass(frozen=True, slots=True)
class MorphTarget:
    """Morph target `number` of mesh `mesh` of the file."""

    mesh: int
    number: int


@dataclass(frozen=True, slots=True, eq=False)
class Material:
    """Material of a piece.

    Parameters
    ----------
    colour
        Red, green, blue (linear light) and alpha; factors of the image where there is one.
    image : (H, W, 4)
        sRGB and alpha, or None.
    transform : (2, 3)
        Affine transform of texture coordinates.
    """

    name: str
    colour: tuple[float, float, float, float] = (0.8, 0.8, 0.8, 1.0)
    image: NDArray[np.uint8] | None = None
    transform: FloatArray = field(default_factory=lambda: np.eye(2, 3))
    alpha_mode: str = OPAQUE
    cutoff: float = 0.5
    roughness: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class MaterialPiece:
    """Triangles of one material at rest, in world coordinates: y up.

    Parameters
    ----------
    name
        Names of its mesh, node and material.
    vertices, triangles : (N, 3), (F, 3)
    uv, colours : (N, 2), (N, 3)
        Texture coordinates from the top left corner; linear light; or None.
    material
        Index of its material.
    morphs
        Displacement (N, 3) of each morph target that it has.
    bones : (N,)
        Node that each vertex follows most.
    defaults
        Weights other than 0 of morph targets in the file, which `vertices` include.
    """

    name: str
    vertices: FloatArray
    triangles: IntArray
    uv: FloatArray | None
    colours: FloatArray | None
    material: int
    morphs: Mapping[MorphTarget, NDArray[np.float32]]
    bones: IntArray
    defaults: Mapping[MorphTarget, float] = field(default_factory=dict)

    def is_moved_by(self, morph: NDArray[np.float32]) -> bool:
        """Whether a displacement (N, 3) is more than the noise of a quantised file."""
        size = float(np.ptp(self.vertices, axis=0).max(initial=0.0)) if len(self.vertices) else 0.0
        return bool(np.abs(morph).max(initial=0.0) > STILL_SHARE * size)


@dataclass(frozen=True, slots=True, eq=False)
class Character:
    """Everything that is read from a character's file.

    Parameters
    ----------
    target_names
        Name of each morph target; several meshes may use one name.
    expressions
        Expressions of a VRM file: name -> weights of morph targets.
    bones
        Nodes of ``head``, ``neck``, ``leftEye`` and ``rightEye`` as far as they are known.
    bone_places
        Position (3,) of each of them in world coordinates.
    parents
        Parent of each node that has one.
    faces_back
        Whether the character looks along -z (VRM 0), not +z.
    licence
        What the file says about its licence and author.
    painted
        Expressions that change textures or colours and no shape.
    notes
        What was not read, in sentences.
    """

    pieces: tuple[MaterialPiece, ...]
    materials: tuple[Material, ...]
    target_names: Mapping[MorphTarget, str]
    expressions: Mapping[str, Mapping[MorphTarget, float]]
    bones: Mapping[str, int]
    bone_places: Mapping[str, FloatArray]
    parents: Mapping[int, int]
    faces_back: bool
    licence: str
    painted: frozenset[str] = frozenset()
    notes: tuple[str, ...] = ()

    @property
    def moving_names(self) -> tuple[str, ...]:
        """Names of morph targets and expressions that move a vertex; files hold empty ones for programs to find."""
        moved = {target for piece in self.pieces for target, morph in piece.morphs.items() if piece.is_moved_by(morph)}
        targets = [name for target, name in self.target_names.items() if target in moved]
        bound = [name for name, binds in self.expressions.items() if moved & {t for t in binds if binds[t]}]
        return tuple(dict.fromkeys([*targets, *bound]))

    def reach(self, name: str) -> float:
        """Largest displacement of a vertex by the morph targets of a name, or by an expression, in the file's units."""
        moved = (float(np.linalg.norm(morph, axis=1).max(initial=0.0)) for morph in self._displacements(name))
        return max(moved, default=0.0)

    def drift(self, name: str) -> FloatArray:
        """Sum (3,) of all displacements: to the character's left, up and ahead."""
        turn = np.array([-1.0, 1.0, -1.0]) if self.faces_back else np.ones(3)
        return turn * sum((morph.sum(axis=0, dtype=np.float64) for morph in self._displacements(name)), np.zeros(3))

    def _displacements(self, name: str) -> Iterator[NDArray[np.float32]]:
        """Displacements (N, 3) of the pieces by the morph targets of a name, or by those of an expression."""
        targets = {target: 1.0 for target, own in self.target_names.items() if own == name}
        for piece in self.pieces:
            for target, weight in (targets or self.expressions.get(name, {})).items():
                if target in piece.morphs:
                    yield np.float32(weight) * piece.morphs[target]

    @property
    def still_names(self) -> tuple[str, ...]:
        """Names of morph targets and expressions that move nothing."""
        moving = set(self.moving_names)
        return tuple(n for n in dict.fromkeys([*self.target_names.values(), *self.expressions]) if n not in moving)


def affine(points: FloatArray, matrix: FloatArray) -> FloatArray:
    """Points (N, 3) transformed by a matrix (4, 4) or by one matrix for each point (N, 4, 4)."""
    if matrix.ndim == 3:
        moved: FloatArray = np.einsum("nij,nj->ni", matrix[:, :3, :3], points) + matrix[:, :3, 3]
        return moved
    moved = points @ matrix[:3, :3].T + matrix[:3, 3]
    return moved


def linear(points: FloatArray, matrix: FloatArray) -> FloatArray:
    """Displacements (N, 3) transformed by the linear part of a matrix (4, 4) or of matrices (N, 4, 4)."""
    if matrix.ndim == 3:
        moved: FloatArray = np.einsum("nij,nj->ni", matrix[:, :3, :3], points)
        return moved
    moved = points @ matrix[:3, :3].T
    return moved
