"""Reading of a character from an .obj file, or a folder: one at rest, as ``neutral.obj``, and one for each shape."""

from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from tts2face.interchange.characters.character import Character, Material, MaterialPiece, MorphTarget
from tts2face.interchange.characters.landmark_table import MAX_COORDINATE
from tts2face.interchange.characters.name_words import all_words
from tts2face.interchange.characters.obj_materials import read_libraries, read_lines
from tts2face.numeric.arrays import FloatArray
from tts2face.picture.kernels.tones import linear_light

NEUTRAL, OTHER_NEUTRALS = "neutral", ("basis", "base", "rest", "default")
OBJ = ".obj"
MAX_OBJ_VERTICES = 500_000
MAX_SHAPES = 500


def read_obj_folder(folder: Path) -> Character:
    """Character of a folder: faces, texture places and materials of the face at rest, and shapes of equal vertices."""
    # sorted: folders list their files in any order
    paths = sorted(path for path in folder.iterdir() if path.suffix.lower() == OBJ and path.is_file())
    neutral = _find_neutral(folder, paths)
    shapes = [path for path in paths if path != neutral]
    if len(shapes) > MAX_SHAPES:
        raise DataError(f"{folder} has {len(shapes)} shapes; reduce them to at most {MAX_SHAPES}")
    mesh = _ObjFile(neutral)
    moved: dict[MorphTarget, NDArray[np.float32]] = {}
    for number, path in enumerate(shapes):
        places = read_vertices(path)
        if len(places) != len(mesh.vertices):
            raise DataError(
                f"{path} has {len(places)} vertices, but {neutral.name} has {len(mesh.vertices)}; export it again"
            )
        moved[MorphTarget(0, number)] = (places - mesh.vertices).astype(np.float32)
    return replace(mesh.character(moved), target_names=dict(zip(moved, (path.stem for path in shapes), strict=True)))


def read_obj(path: Path) -> Character:
    """Character of one .obj file, which has no shapes; its materials lie beside it."""
    return _ObjFile(path).character({})


def _find_neutral(folder: Path, paths: list[Path]) -> Path:
    """The face at rest: ``neutral.obj`` in any case, else the one file whose name has the word, else ``base.obj``."""
    exact = [path for path in paths if path.stem.lower() == NEUTRAL]
    worded = [path for path in paths if NEUTRAL in all_words(path.stem)]
    others = [path for path in paths if path.stem.lower() in OTHER_NEUTRALS]
    found = next((some for some in (exact, worded, others) if some), [])
    if len(found) > 1:
        names = ", ".join(path.name[:60] for path in found[:4])
        raise DataError(f"{folder} has several faces at rest ({names}); leave one of them in it")
    if not found:
        raise DataError(f"{folder} has no {NEUTRAL}{OBJ}; name the face at rest so")
    return found[0]


def read_vertices(path: Path) -> FloatArray:
    """Vertices (V, 3) of an .obj file."""
    lines = (line.split() for line in read_lines(path) if line.startswith(("v ", "v\t")))
    return _numbers([line[1:4] for line in lines], 3, path)


class _ObjFile:
    """Vertices, their colours, texture coordinates, faces and names of materials of an .obj file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.vertices = read_vertices(path)
        self._colours = _read_colours(path)
        coordinates: list[list[str]] = []
        self.materials: list[str] = []
        self.libraries: list[str] = []
        self._corners: list[tuple[int, int]] = []
        self._of: list[int] = []
        self._current = 0
        for line in read_lines(path):
            key, _, rest = line.partition(" ")
            if key == "vt":
                coordinates.append(rest.split()[:2])
            elif key == "usemtl":
                self._use(rest.strip())
            elif key == "mtllib":
                self.libraries.append(rest.strip())
            elif key == "f":
                self._face(rest.split(), len(coordinates))
        self._uv = _numbers(coordinates, 2, path)
        if not self.materials:
            self._use("plain")

    def character(self, moved: Mapping[MorphTarget, NDArray[np.float32]]) -> Character:
        """Character of the file, with unnamed shapes that move its vertices (V, 3)."""
        known = read_libraries(self._path.parent, self.libraries)
        materials = [known.get(name, Material(name, (1.0, 1.0, 1.0, 1.0))) for name in self.materials]
        pieces = tuple(self.piece(number, moved) for number in range(len(materials)))
        pieces = tuple(piece for piece in pieces if len(piece.triangles))
        if not pieces:
            raise DataError(f"{self._path} has no faces; export the mesh, not only its points")
        return Character(pieces, tuple(materials), {}, {}, {}, {}, {}, faces_back=False, licence="")

    def piece(self, material: int, shapes: Mapping[MorphTarget, NDArray[np.float32]]) -> MaterialPiece:
        """Triangles of one material; vertices are divided at seams of the texture."""
        rows = np.array([n for n, used in enumerate(self._of) if used == material], np.int64)
        table = np.array(self._corners, np.int64).reshape(-1, 3, 2)[rows].reshape(-1, 2)
        unique, places = np.unique(table, axis=0, return_inverse=True)
        uv = None
        if len(unique) and (unique[:, 1] >= 0).all() and int(unique[:, 1].max()) < len(self._uv):
            # .obj counts v from the lower edge, faces and glTF from the upper one
            uv = self._uv[unique[:, 1]] * [1.0, -1.0] + [0.0, 1.0]
        return MaterialPiece(
            name=self.materials[material],
            vertices=self.vertices[unique[:, 0]],
            triangles=places.reshape(-1, 3),
            uv=uv,
            colours=None if self._colours is None else self._colours[unique[:, 0]],
            material=material,
            morphs={target: moved[unique[:, 0]] for target, moved in shapes.items()},
            bones=np.zeros(len(unique), np.int64),
        )

    def _use(self, name: str) -> None:
        if name not in self.materials:
            self.materials.append(name)
        self._current = self.materials.index(name)

    def _face(self, cells: list[str], n_coordinates: int) -> None:
        if not self.materials:
            self._use("plain")
        corners = [self._corner(cell, n_coordinates) for cell in cells]
        if len(corners) < 3:
            raise DataError(f"{self._path}: a face has {len(corners)} corners; export the mesh again")
        for second, third in pairwise(corners[1:]):
            self._corners += [corners[0], second, third]
            self._of.append(self._current)

    def _corner(self, cell: str, n_coordinates: int) -> tuple[int, int]:
        parts = cell.split("/")
        try:
            vertex = int(parts[0])
            coordinate = int(parts[1]) if len(parts) > 1 and parts[1] else 0
        except ValueError as error:
            raise DataError(
                f"{self._path}: the corner {cell[:40]!r} of a face is not a number; export it again"
            ) from error
        vertex = vertex - 1 if vertex > 0 else len(self.vertices) + vertex
        coordinate = coordinate - 1 if coordinate > 0 else n_coordinates + coordinate if coordinate else -1
        if not 0 <= vertex < len(self.vertices) or coordinate < -1:
            raise DataError(f"{self._path}: a face uses vertex {vertex + 1} of {len(self.vertices)}; export it again")
        return vertex, coordinate


def _read_colours(path: Path) -> FloatArray | None:
    """Colours (V, 3) in linear light that scanners and MeshLab write behind the places of vertices; None without."""
    rows = [line.split()[4:7] for line in read_lines(path) if line.startswith(("v ", "v\t"))]
    if not rows or any(len(row) < 3 for row in rows):
        return None
    values = _numbers(rows, 3, path)
    # some programs count colours to 1, some to 255
    srgb = np.rint(np.clip(values if values.max() > 1.0 else 255.0 * values, 0.0, 255.0)).astype(np.uint8)
    return linear_light(srgb).astype(np.float64)


def _numbers(rows: list[list[str]], width: int, path: Path) -> FloatArray:
    if len(rows) > MAX_OBJ_VERTICES:
        raise DataError(f"{path} has {len(rows)} vertices; reduce them to at most {MAX_OBJ_VERTICES}")
    try:
        table = np.array(rows, np.float64).reshape(-1, width)
    except ValueError as error:
        raise DataError(f"{path}: a vertex is not {width} numbers; export it again") from error
    if not (np.abs(table) <= MAX_COORDINATE).all():
        raise DataError(f"{path}: a coordinate is not finite or beyond {MAX_COORDINATE:g}; export it again")
    return table
