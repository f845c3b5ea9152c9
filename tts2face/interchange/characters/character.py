"""Character: meshes, materials, named shapes and bones of an imported file, in the file's own units.

What a face keeps about the character that it was imported from, to write animation back onto its file.
"""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face.interchange.characters.shapes import ShapeMapping, ShapeSource
from tts2face.models.face import Face

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
OPAQUE = "OPAQUE"
MASK = "MASK"
BLEND = "BLEND"
KEY = "character"  # of the face's metadata


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
    notes: tuple[str, ...] = ()


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


@dataclass(frozen=True, slots=True)
class CharacterBinding:
    """Link from a face to the file of its character.

    Parameters
    ----------
    file, sha256
        Path of the file and hash of its content; no hash for .obj files.
    yaw_deg, scale, origin
        Turn of the file's axes about y, then ``mm = (place - origin) * scale``.
    mapping
        Morph targets and expressions of each shape.
    """

    file: str
    sha256: str
    yaw_deg: float
    scale: float
    origin: tuple[float, float, float]
    mapping: ShapeMapping

    def as_metadata(self) -> dict[str, Any]:
        """The binding as JSON."""
        sources = {
            shape: [[source.name, source.gain, source.side] for source in self.mapping[shape]] for shape in self.mapping
        }
        plain = {key: value for key, value in asdict(self).items() if key != "mapping"}
        return plain | {"origin": list(self.origin), "mapping": sources}


def has_binding(face: Face) -> bool:
    """Whether a face was imported from a file onto which animation can be written."""
    found = face.metadata.get(KEY)
    return isinstance(found, dict) and bool(found.get("sha256"))


def read_binding(face: Face) -> CharacterBinding:
    """Binding of an imported face.

    Raises
    ------
    InputError
        The face was not imported, or was imported from .obj files.
    DataError
        Its metadata are damaged.
    """
    found = face.metadata.get(KEY)
    if not isinstance(found, dict):
        raise InputError("the face was not imported from a character's file; import one with `tts2face face import`")
    if not found.get("sha256"):
        raise InputError("the face was imported from .obj files, which hold no animation; import a .glb file instead")
    try:
        x, y, z = (float(value) for value in found["origin"])
        binding = CharacterBinding(
            file=str(found["file"]),
            sha256=str(found["sha256"]),
            yaw_deg=float(found["yaw_deg"]),
            scale=float(found["scale"]),
            origin=(x, y, z),
            mapping={
                str(shape): tuple(ShapeSource(str(name), float(gain), str(side)) for name, gain, side in sources)
                for shape, sources in found["mapping"].items()
            },
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _damaged() from error
    numbers = (binding.yaw_deg, binding.scale, x, y, z)
    if not all(math.isfinite(value) for value in numbers) or binding.scale <= 0:
        raise _damaged()
    return binding


def character_file(binding: CharacterBinding, given: str | Path | None = None) -> Path:
    """Path of the character's file, unchanged since its import; by default the path of the import.

    Raises
    ------
    DataError
        The file is missing or has changed.
    """
    path = Path(binding.file if given is None else given)
    if not path.is_file() and given is not None:
        raise DataError(f"there is no character {path}; check the path")
    if not path.is_file():
        raise DataError(
            f"there is no character {path}, from which the face was imported; "
            "if it was moved, run `tts2face face relink FACE.face CHARACTER`"
        )
    if sha256(path.read_bytes()).hexdigest() != binding.sha256:
        raise DataError(
            f"the content of {path} differs from the file from which the face was imported; "
            "import it again, or give that file"
        )
    return path


def _damaged() -> DataError:
    return DataError("what the face says about its character is damaged; import the character again")
