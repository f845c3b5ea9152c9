"""Shapes carried over to heads without any: python tests/bench/bench_transfer.py [--ict FILE.npz] [CHARACTER ...].

Shipped faces whose own shapes are hidden show the error of each shape; they, identities of the ICT-FaceKit (its light
model as arrays, see `ict_head`) and characters of files speak a text with p, b and m, and blink. A head of 50,000
vertices is timed.
"""

import argparse
import runpy
import sys
import tempfile
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.interchange.characters.build.test_dense import dense_head
from tests.interchange.characters.made import Variant, write_character_file
from tts2face import Session
from tts2face.face.eyelids import SIDES
from tts2face.face.mesh_calibration import calibrate_on_mesh
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.transfer.lids import seen_eyeball
from tts2face.interchange.characters.transfer.parts import is_kind, triangles_of
from tts2face.interchange.characters.transfer.sight import view_ahead
from tts2face.interchange.characters.transfer.skin import build_skin
from tts2face.interchange.characters.transfer.source import own_landmarks
from tts2face.interchange.characters.transfer.tracked import locate_bare_landmarks, without_colours
from tts2face.interchange.characters.transfer.transfer import transfer_shapes
from tts2face.lips.retargeting import BILABIALS
from tts2face.models.face import Face, FacePart, keep_parts
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, LEFT_LIDS, LIP_LANDMARKS, RIGHT_LIDS
from tts2face.numeric.arrays import FloatArray, IntArray

ROOT = Path(__file__).parents[2]
TEXT = "Bob made papa a map. My mum bought a big pebble, and Peter may swim."  # 17 p, b, m
SHIPPED = (("head", "mara"), ("head", "tomas"), ("ada", "ben"), ("ada", "zuri"))
STATUES = ("mara", "tomas", "noor")  # closed surfaces
LIPS_MM, LIDS_MM = 15.0, 8.0  # from lips and lids: skin at which errors are measured
LEAST_MM = 0.15  # mean motion there of a shape that counts
ICT_SEEDS = (1, 2, 3, 4)
ICT_PARTS = {
    "M_Face": "skin", "M_BackHead": "skin", "M_GumsTongue": "teeth", "M_Teeth": "teeth", "M_ScleraLeft": "eyes",
    "M_ScleraRight": "eyes", "M_IrisLeft": "iris", "M_IrisRight": "iris", "M_EyeLashes": "lashes",
}  # fmt: skip


@dataclass(frozen=True)
class Spoken:
    """Heights in mm that are seen between the lips: at rest, the largest of the best frames of p b m, the widest."""

    n_phones: int
    rest: float
    closed: float
    widest: float


def bare_face(name: str) -> Face:
    """A shipped face in plain colours, with its own shapes and without hair and clothes."""
    return without_colours(keep_parts(load_face(name), lambda part: not is_kind(part.name, "other")))


def carried(face: Face, source: str) -> Face:
    """The face with the shapes of a source, by landmarks that are found on it."""
    found = locate_bare_landmarks(face)
    face = replace(
        face, landmarks=found.numbers.astype(np.int32), landmark_vertices=found.points.vertices.astype(np.int32),
        landmark_weights=found.points.weights.astype(np.float32),
    )  # fmt: skip
    return calibrate_on_mesh(transfer_shapes(face, source).face)


def measured_rows(face: Face) -> IntArray:
    """Vertices of the seen skin around lips and lids, one for each place."""
    skin = build_skin(face, own_landmarks(face))

    def is_near(numbers: list[int], mm: float) -> np.ndarray:
        apart = skin.vertices[:, None] - skin.landmarks[numbers]
        return np.linalg.norm(apart, axis=2).min(axis=1) < mm

    lids = list({*np.ravel(RIGHT_LIDS).tolist(), *np.ravel(LEFT_LIDS).tolist()})
    return skin.rows()[(is_near(list(LIP_LANDMARKS), LIPS_MM) | is_near(lids, LIDS_MM)) & skin.is_seen]


def shape_errors(made: Face, own: Face, rows: IntArray) -> dict[str, float]:
    """Mean error of each shape over these vertices, as a share of the own shape's mean motion there."""
    errors = {}
    for name, shape in zip(made.shape_names, made.shapes[:, rows], strict=True):
        if name in own.shape_names:
            true = own.shapes[own.shape_names.index(name), rows]
            size = float(np.linalg.norm(true, axis=1).mean())
            if size >= LEAST_MM:
                errors[name] = float(np.linalg.norm(shape - true, axis=1).mean()) / size
    return errors


def spoken(face: Face) -> Spoken:
    """Heights seen between the lips while a face speaks, by a depth buffer."""
    face = replace(face, metadata={"name": "bench", "licence": "", "attribution": ""})
    session = Session(face=face)
    clip, shapes = session.clip(TEXT), session.mesh.shapes
    weights, times = clip.motion.values.astype(np.float64), clip.motion.times
    skin = build_skin(face, own_landmarks(face))
    is_hidden = np.zeros(len(face.vertices), bool)
    is_hidden[skin.of_face >= 0] = ~skin.is_seen[skin.of_face[skin.of_face >= 0]]
    is_inside = triangles_of(face, "teeth", "tongue", "mouth")
    is_inside |= triangles_of(face, "skin") & is_hidden[face.triangles].all(axis=1)
    shown = is_inside | triangles_of(face, "skin")
    lips = skin.landmarks[[*INNER_LIP_UPPER, *INNER_LIP_LOWER]]
    margin = np.array([2.0, 25.0, 0.0])

    def seen(frame: int | None) -> float:
        moved = 0.0 if frame is None else np.tensordot(weights[frame], shapes, 1)
        box = (lips.min(axis=0) - margin, lips.max(axis=0) + margin)
        sight = view_ahead(face.vertices + moved, face.triangles[shown], box)
        return float(sight.heights(is_inside[shown]).max())

    places = face.landmark_weights[:, :, None] * shapes[:, face.landmark_vertices]
    motion = places.sum(axis=2)[..., 1]  # (K, L)
    at = {int(number): row for row, number in enumerate(face.landmarks)}
    upper, lower = ([at[n] for n in line] for line in (INNER_LIP_UPPER, INNER_LIP_LOWER))
    gaps = (weights @ (motion[:, upper] - motion[:, lower])).max(axis=1)
    phones, closed = clip.speech.phones, []
    for phone, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True):
        if phone in BILABIALS:
            frames = np.flatnonzero((times >= start) & (times <= end))
            closed.append(seen(int(frames[gaps[frames].argmin()])))
    return Spoken(len(closed), seen(None), max(closed), seen(int(gaps.argmax())))


def seen_in_blinks(face: Face) -> float:
    """Largest height of an eyeball that is seen in a blink, mm; NaN for a face whose eyes cannot blink."""
    if not triangles_of(face, "eyes").any():
        return float("nan")
    landmarks = own_landmarks(face)
    blinks = {side: face.shapes[face.shape_names.index(f"eyeBlink{side}")] for side in SIDES}
    return max(seen_eyeball(face, landmarks, face.vertices + blink, side) for side, blink in blinks.items())


def ict_head(path: Path, seed: int) -> Face:
    """A head without shapes of an ICT-FaceKit: arrays vertices, faces, materials, material, identity_deltas; cm."""
    arrays = np.load(path)
    weights = np.random.default_rng(seed).normal(size=len(arrays["identity_deltas"]))
    places: FloatArray = arrays["vertices"] + np.tensordot(weights, arrays["identity_deltas"].astype(np.float64), 1)
    quads, names = arrays["faces"], arrays["materials"][arrays["material"]]
    is_quad = quads[:, 3] >= 0
    corners = np.concatenate([quads[:, :3], quads[is_quad][:, [0, 2, 3]]])
    kinds = np.array([ICT_PARTS.get(str(name), "") for name in [*names, *names[is_quad]]])
    parts: list[FacePart] = []
    triangles: list[IntArray] = []
    first = 0
    for kind in dict.fromkeys(ICT_PARTS.values()):
        triangles.append(corners[kinds == kind])
        parts.append(FacePart(kind, first, len(triangles[-1]), 0.1, 16.0, 0.3))
        first += len(triangles[-1])
    n = len(places)
    return without_colours(
        Face(
            vertices=(10 * (places - places.mean(axis=0))).astype(np.float32), parts=tuple(parts), eyes=(), uv=None,
            triangles=np.concatenate(triangles).astype(np.int32), shape_names=(), textures=(),
            shapes=np.zeros((0, n, 3), np.float32), limits=np.zeros((0, 2), np.float32),
            colours=np.zeros((n, 3), np.uint8), pivot=np.zeros(3, np.float32), landmarks=np.zeros(0, np.int32),
            landmark_vertices=np.zeros((0, 3), np.int32), landmark_weights=np.zeros((0, 3), np.float32),
        )
    )  # fmt: skip


def row(name: str, face: Face, error: str = "-") -> None:
    """Print the figures of a face."""
    said = spoken(face)
    figures = [f"{value:.2f}" for value in (said.rest, said.closed, said.widest, seen_in_blinks(face))]
    print("| " + " | ".join([name, error, str(said.n_phones), *figures]) + " |", flush=True)


def timed_import(path: Path) -> tuple[Face, str]:
    """Face of a character's file, and the time that it took."""
    start, cpu = time.perf_counter(), time.process_time()
    face = import_face(path, shapes="transfer").face
    return face, f"{time.perf_counter() - start:.0f} s, {time.process_time() - cpu:.0f} s of CPU"


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("characters", nargs="*", type=Path)
    parser.add_argument("--ict", type=Path)
    parser.add_argument("--only", nargs="*", help="Names of shipped faces; without names, none.")
    options = parser.parse_args()
    print("| head | error, % (worst) | p b m | seen at rest, mm | at p b m | widest | eyeball in a blink |")
    print("| --- | --- | --- | --- | --- | --- | --- |", flush=True)
    for source, name in SHIPPED:
        if options.only is not None and name not in options.only:
            continue
        own = bare_face(name)
        made = carried(own, source)
        errors = shape_errors(made, own, measured_rows(own))
        worst = max(errors, key=lambda shape: errors[shape])
        median = 100 * float(np.median(list(errors.values())))
        row(f"{name} from {source}", made, f"{median:.1f} ({worst} {100 * errors[worst]:.0f})")
    with tempfile.TemporaryDirectory() as folder:
        write_statue = runpy.run_path(str(ROOT / "docs/statue.py"))["write_statue"]
        for name in STATUES:
            write_statue(load_face(name), Path(folder) / "statue.obj")
            row(f"statue of {name}", *timed_import(Path(folder) / "statue.obj"))
        dense = write_character_file(Path(folder) / "dense.glb", Variant(is_dense=True), face=dense_head())
        face, seconds = timed_import(dense)
        row(f"head of {len(face.vertices)} vertices", face, seconds)
        for seed in ICT_SEEDS if options.ict else ():
            path = write_character_file(Path(folder) / f"ict{seed}.glb", face=ict_head(options.ict, seed))
            row(f"ICT {seed}", *timed_import(path))
    for path in options.characters:
        row(path.stem, *timed_import(path))


if __name__ == "__main__":
    main()
