"""Reading of a character from a glTF or VRM file.

Reading of a character from a folder of .obj files: ``neutral.obj`` and one file for each shape.

Materials of .obj files: colours, images and transparency of .mtl libraries.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError
from lexicon.values.files import read_text
from tts2face.interchange.characters.character import BLEND, Character, Material, MaterialPiece, MorphTarget
from tts2face.interchange.characters.landmarks import MAX_COORDINATE
from tts2face.interchange.characters.meshes import MaterialReader, decode_image, read_pieces, target_names
from tts2face.interchange.gltf.fields import Fields
from tts2face.interchange.gltf.nodes import find_bones, read_nodes
from tts2face.interchange.gltf.reader import GltfFile, read_bytes, read_gltf
from tts2face.picture.kernels.tables import linear_light

MAX_LICENCE = 500  # characters

Expressions = dict[str, Mapping[MorphTarget, float]]


def read_gltf_character(path: Path) -> Character:
    """Character of a .glb, .gltf or .vrm file."""
    file = read_gltf(path)
    notes: list[str] = []
    tree = read_nodes(file.root)
    pieces = tuple(read_pieces(file, tree))
    if not any(len(piece.triangles) for piece in pieces):
        raise DataError(f"{path} has no mesh with triangles in its scene; export the character again")
    materials = (*MaterialReader(file, notes).materials(), Material("plain"))
    names = {
        MorphTarget(number, target): name
        for number, mesh in enumerate(file.entries("meshes"))
        for target, name in enumerate(target_names(mesh))
    }
    expressions, is_vrm0 = _expressions(file)
    bones = find_bones(file.root, tree)
    return Character(
        pieces=pieces,
        materials=materials,
        target_names=names,
        expressions=expressions,
        bones=bones,
        bone_places={bone: tree.world[node][:3, 3] for bone, node in bones.items()},
        parents=tree.parents,
        faces_back=is_vrm0,
        licence=_licence(file.root),
        notes=tuple(dict.fromkeys(notes)),
    )


def _expressions(file: GltfFile) -> tuple[Expressions, bool]:
    """Expressions of a VRM file as weights of morph targets, and whether the file is VRM 0."""
    if (recent := file.root.extension("VRMC_vrm")) is not None:
        return _vrm1_expressions(file, recent.child("expressions")), False
    if (earlier := file.root.extension("VRM")) is not None:
        return _vrm0_expressions(file, earlier.child("blendShapeMaster")), True
    return {}, False


def _vrm1_expressions(file: GltfFile, fields: Fields) -> Expressions:
    nodes, found = file.entries("nodes"), Expressions()
    for group in ("preset", "custom"):
        named = fields.child(group)
        for name in named.content:
            binds: dict[MorphTarget, float] = {}
            for bind in named.child(name).children("morphTargetBinds"):
                node = bind.index("node", len(nodes), "nodes")
                mesh = None if node is None else nodes[node].index("mesh", file.count("meshes"), "meshes")
                if mesh is not None:
                    binds[MorphTarget(mesh, bind.integer("index"))] = bind.number("weight", 1.0)
            found[str(name)] = binds
    return found


def _vrm0_expressions(file: GltfFile, fields: Fields) -> Expressions:
    found = Expressions()
    for group in fields.children("blendShapeGroups"):
        binds: dict[MorphTarget, float] = {}
        for bind in group.children("binds"):
            mesh = bind.index("mesh", file.count("meshes"), "meshes")
            if mesh is not None:
                binds[MorphTarget(mesh, bind.integer("index"))] = bind.number("weight", 100.0) / 100.0
        preset = group.text("presetName")
        found[preset if preset not in ("", "unknown") else group.text("name")] = binds
    return found


def _licence(root: Fields) -> str:
    """Licence, author and copyright as the file states them."""
    parts = [root.child("asset").text("copyright")]
    for extension in (root.extension("VRMC_vrm"), root.extension("VRM")):
        if extension is not None:
            meta = extension.child("meta").content
            parts += [
                f"{key} {value}"
                for key, value in meta.items()
                if isinstance(value, str) and value and ("licen" in key.lower() or key in ("author", "title", "name"))
            ]
    return "; ".join(filter(None, parts))[:MAX_LICENCE]


MAX_TEXT_BYTES = 200_000_000
GREY = 0.02  # greatest difference between the channels of a colour that exporters write for an unpainted material


def read_lines(path: Path) -> list[str]:
    """Lines of a text file.

    Raises
    ------
    DataError
        The file cannot be read or is too large.
    """
    try:
        return read_text(path, MAX_TEXT_BYTES).splitlines()
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the file") from refused


def read_libraries(folder: Path, libraries: Iterable[str]) -> dict[str, Material]:
    """Materials by name of the .mtl files in a folder; missing files are skipped.

    ``map_Kd`` is the image, ``Kd`` the colour without one, ``d`` or ``Tr`` the transparency; ``map_d``, or the alpha of
    the image, is where the material has holes.
    """
    found: dict[str, Material] = {}
    for library in libraries:
        path = _beside(folder, library)
        name, fields = "", dict[str, str]()
        for line in [*(read_lines(path) if path is not None else ()), "newmtl"]:
            key, _, rest = line.strip().partition(" ")
            if key == "newmtl":
                if name:
                    found.setdefault(name, _material(name, fields, folder))
                name, fields = rest.strip(), {}
            else:
                fields[key] = rest.strip()
    return found


def _material(name: str, fields: dict[str, str], folder: Path) -> Material:
    image = _image(folder, fields.get("map_Kd", ""))
    holes = _image(folder, fields.get("map_d", ""))
    if image is not None and holes is not None:
        image = _with_alpha(image, holes)
    opacity = _number(fields.get("d", "")) if "d" in fields else 1.0 - _number(fields.get("Tr", "0"))
    material = Material(name, (*_colour(fields, image), min(max(opacity, 0.0), 1.0)), image)
    has_holes = opacity < 1.0 or (image is not None and int(image[:, :, 3].min()) < 255)
    return replace(material, alpha_mode=BLEND) if has_holes else material


def _colour(fields: dict[str, str], image: NDArray[np.uint8] | None) -> tuple[float, float, float]:
    """Linear colour; white with an image, and for the grey of unpainted materials."""
    cells = fields.get("Kd", "").split()
    if image is not None or len(cells) < 3:
        return 1.0, 1.0, 1.0
    values = np.clip([_number(cell) for cell in cells[:3]], 0.0, 1.0)
    if float(np.ptp(values)) < GREY:
        return 1.0, 1.0, 1.0
    red, green, blue = linear_light(np.rint(255 * values).astype(np.uint8)).astype(float).tolist()
    return red, green, blue


def _with_alpha(image: NDArray[np.uint8], holes: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Image (H, W, 4) whose alpha is that of another one, or its brightness where that one is opaque."""
    from PIL import Image

    has_alpha = int(holes[:, :, 3].min()) < 255
    alpha = holes[:, :, 3] if has_alpha else holes[:, :, :3].mean(axis=2).astype(np.uint8)
    size = (image.shape[1], image.shape[0])
    resized = np.array(Image.fromarray(alpha).resize(size, Image.Resampling.BILINEAR))
    return np.dstack([image[:, :, :3], resized])


def _image(folder: Path, statement: str) -> NDArray[np.uint8] | None:
    """Image (H, W, 4) that a statement names, which may hold spaces, or names after its options; None without one."""
    path = _beside(folder, statement) or _beside(folder, statement.rpartition(" ")[2])
    return None if path is None else decode_image(read_bytes(path), str(path))


def _number(cell: str) -> float:
    try:
        value = float(cell)
    except ValueError:
        return 1.0
    return value if np.isfinite(value) else 1.0


def _beside(folder: Path, name: str) -> Path | None:
    relative = Path(name)
    if not name or "\0" in name or relative.is_absolute() or ".." in relative.parts:
        return None
    path = folder / relative
    return path if path.is_file() else None


NEUTRAL = "neutral.obj"
MAX_OBJ_VERTICES = 500_000
MAX_SHAPES = 500

FloatArray = NDArray[np.float64]


def read_obj_folder(folder: Path) -> Character:
    """Character of a folder: faces, texture places and materials of ``neutral.obj``, and shapes of equal vertices."""
    neutral = folder / NEUTRAL
    if not neutral.is_file():
        raise DataError(f"{folder} has no {NEUTRAL}; name the face at rest so")
    shapes = sorted(path for path in folder.glob("*.obj") if path.name != NEUTRAL)
    if len(shapes) > MAX_SHAPES:
        raise DataError(f"{folder} has {len(shapes)} shapes; reduce them to at most {MAX_SHAPES}")
    mesh = _ObjFile(neutral)
    names = {MorphTarget(0, number): path.stem for number, path in enumerate(shapes)}
    moved: dict[MorphTarget, NDArray[np.float32]] = {}
    for target, path in zip(names, shapes, strict=True):
        places = read_vertices(path)
        if len(places) != len(mesh.vertices):
            raise DataError(
                f"{path} has {len(places)} vertices, but {NEUTRAL} has {len(mesh.vertices)}; export it again"
            )
        moved[target] = (places - mesh.vertices).astype(np.float32)
    known = read_libraries(folder, mesh.libraries)
    materials = [known.get(name, Material(name, (1.0, 1.0, 1.0, 1.0))) for name in mesh.materials]
    pieces = tuple(mesh.piece(number, moved) for number in range(len(materials)))
    pieces = tuple(piece for piece in pieces if len(piece.triangles))
    if not pieces:
        raise DataError(f"{neutral} has no faces; export the mesh, not only its points")
    return Character(pieces, tuple(materials), names, {}, {}, {}, {}, faces_back=False, licence="")


def read_vertices(path: Path) -> FloatArray:
    """Vertices (V, 3) of an .obj file."""
    lines = (line.split() for line in read_lines(path) if line.startswith(("v ", "v\t")))
    return _numbers([line[1:4] for line in lines], 3, path)


class _ObjFile:
    """Vertices, texture coordinates, faces and names of materials of an .obj file."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self.vertices = read_vertices(path)
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

    def piece(self, material: int, shapes: dict[MorphTarget, NDArray[np.float32]]) -> MaterialPiece:
        """Triangles of one material; vertices are divided at seams of the texture."""
        rows = np.array([n for n, used in enumerate(self._of) if used == material], np.int64)
        table = np.array(self._corners, np.int64).reshape(-1, 3, 2)[rows].reshape(-1, 2)
        unique, places = np.unique(table, axis=0, return_inverse=True)
        uv = None
        if len(unique) and (unique[:, 1] >= 0).all() and int(unique[:, 1].max()) < len(self._uv):
            uv = self._uv[unique[:, 1]] * [1.0, -1.0] + [0.0, 1.0]
        return MaterialPiece(
            name=self.materials[material],
            vertices=self.vertices[unique[:, 0]],
            triangles=places.reshape(-1, 3),
            uv=uv,
            colours=None,
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
