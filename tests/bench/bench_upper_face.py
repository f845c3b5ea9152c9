"""Shapes of drawn faces against what a tracker reads in their pictures: scores, and weights of brows from landmarks.

Run: ``python tests/bench/bench_upper_face.py --page docs/marks.md`` renews the table of that page;
``--write`` makes ``tts2face/lips/upper_face.tsv``.
Each shape is drawn at weights .5 and 1, alone and with that of the other side. Faces with even numbers teach, those
with odd numbers test. ``--keep FOLDER`` keeps what was tracked.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np

from tts2face.lips.upper_face import GROUPS, MEASURES, READ_SHAPES, upper_face_measures
from tts2face.models.face_loading import load_face
from tts2face.picture.options import Picture
from tts2face.picture.renderer import mesh_renderer
from tts2face.video.blendshapes import BLENDSHAPES, BlendshapeReader
from tts2face.video.pose import remove_pose
from tts2face.video.tracking import FaceTracker

CAST = (
    ("ada", None), ("ben", None), ("head", None), ("head", "amara"), ("head", "erik"), ("head", "ingrid"),
    ("head", "kofi"), ("head", "leila"), ("head", "mei"), ("head", "nia"), ("head", "ravi"), ("mara", None),
    ("noor", None), ("tomas", None), ("zuri", None),
)  # fmt: skip
RIDGE = 1e-3  # chosen among 1e-4, 3e-4 and 1e-3, with the next one
POSITIVE = 11.0  # weight of a picture in which a shape is not 0: it is in one of fifteen
SIDES = ("Left", "Right")
OPPOSED = ("jaw", "mouth")  # their sides cancel each other


def other_side(name: str) -> str:
    """Name of the mirrored shape or group."""
    for side, other in (SIDES, SIDES[::-1]):
        if name.endswith(side):
            return name.removesuffix(side) + other
    return name


def base_name(name: str) -> str:
    return name.removesuffix("Left").removesuffix("Right")


def draw_and_track(name: str, identity: str | None) -> dict[str, np.ndarray]:
    """Poses and labels of the pictures of a face, and what is read in them."""
    face = load_face(name, identity, hair=None, hair_color=None)
    names = face.shape_names
    alone = [(shape, (shape,)) for shape in names]
    pairs = [(base_name(left), (left, other_side(left))) for left in names if left.endswith("Left")]
    rest = np.zeros(len(names), np.float32)
    rows, labels = [rest] * 4, ["rest"] * 4
    weights = [0.0] * 4
    for label, moved in (*alone, *pairs):
        for weight in (0.5, 1.0):
            pose = rest.copy()
            pose[[names.index(shape) for shape in moved]] = weight
            rows.append(pose)
            labels.append(label)
            weights.append(weight)
        rows.append(rest)
        labels.append("rest")
        weights.append(0.0)
    renderer, reader = mesh_renderer(face, Picture(size="512x512")), BlendshapeReader()
    pictures = [renderer.draw(row) for row in rows]
    points = FaceTracker().track(lambda: pictures, 25.0).points
    return {
        "points": points, "scores": np.array([reader.blendshape_scores(face_points) for face_points in points]),
        "labels": np.array(labels), "w": np.array(weights), "rows": np.array(rows), "names": np.array(names),
    }  # fmt: skip


class Tracked:
    """One face: measures (T, M), scores from rest (T, 52), and the weights (T, R) that were drawn."""

    def __init__(self, read: dict[str, np.ndarray]) -> None:
        self.labels, self.weights = read["labels"], read["w"]
        at_rest = self.labels == "rest"
        landmarks = remove_pose(read["points"], 25.0).landmarks
        self.measures = upper_face_measures(landmarks, np.median(landmarks[at_rest], axis=0))
        self.rest_scores = np.median(read["scores"][at_rest], axis=0)
        self.scores = read["scores"] - self.rest_scores
        names = list(read["names"])
        self.drawn = read["rows"][:, [names.index(shape) for shape in READ_SHAPES]]

    def risen(self, values: np.ndarray, shape: str, weight: float) -> float:
        """Mean of (T,) values where a shape is drawn, alone or with the other side."""
        wanted = [shape] if base_name(shape) in OPPOSED else [shape, base_name(shape)]
        chosen = np.isin(self.labels, wanted) & (self.weights == weight)
        return float(values[chosen].mean())

    def others(self, values: np.ndarray, shape: str) -> float:
        """95th percentile of (T,) values where other shapes are drawn."""
        same = np.array([base_name(str(label)) == base_name(shape) for label in self.labels])
        return float(np.quantile(values[~same], 0.95))


def learn(faces: list[Tracked]) -> np.ndarray:
    """(M, R) ridge regression of weights on measures and their mirror images."""
    groups = list(GROUPS)
    mirror = [groups.index(other_side(group)) for group in groups]
    shapes = [READ_SHAPES.index(other_side(shape)) for shape in READ_SHAPES]
    n = len(groups)
    rows = np.concatenate([face.measures for face in faces])
    inputs = np.concatenate([rows, np.hstack([-rows[:, :n][:, mirror], rows[:, n:][:, mirror]])])
    drawn = np.concatenate([face.drawn for face in faces])
    targets = np.concatenate([drawn, drawn[:, shapes]])
    found = []
    for target in targets.T:
        weighted = inputs * np.where(target > 0, POSITIVE, 1.0)[:, None]
        found.append(np.linalg.solve(weighted.T @ inputs + RIDGE * np.eye(inputs.shape[1]), weighted.T @ target))
    return np.array(found).T


def report(faces: list[Tracked], table: np.ndarray) -> str:
    """Table of all shapes that have a score: median over faces, and the least of them."""
    lines = [
        "| shape | score at rest | it rises at .5, 1 (least) | of others | landmarks at .5, 1 (least) | of others |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    read = {face: np.maximum(face.measures @ table, 0.0) for face in faces}
    for shape in sorted({base_name(name) for name in BLENDSHAPES[1:]}):
        named = [name for name in BLENDSHAPES if name == shape or name in {shape + side for side in SIDES}]
        cells = [_cells(faces, named, lambda face, name: face.scores[:, BLENDSHAPES.index(name)])]
        rest = [face.rest_scores[BLENDSHAPES.index(name)] for face in faces for name in named]
        if named[0] in READ_SHAPES:
            cells.append(_cells(faces, named, lambda face, name: read[face][:, READ_SHAPES.index(name)]))
        shown = f"{shape}Left, {shape}Right" if shape in OPPOSED else shape
        missing = " | - | -" * (2 - len(cells))
        lines.append(f"| `{shown}` | {min(rest):.2f} to {max(rest):.2f} | {' | '.join(cells)}{missing} |")
    return "\n".join(lines)


def _cells(faces: list[Tracked], names: list[str], values: Callable[[Tracked, str], np.ndarray]) -> str:
    half, full = ([[face.risen(values(face, name), name, w) for name in names] for face in faces] for w in (0.5, 1.0))
    others = [face.others(values(face, name), name) for face in faces for name in names]
    return f"{np.median(half):.2f}, {np.median(full):.2f} ({np.min(full):.2f}) | {np.median(others):.2f}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--page", type=Path)
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--write", action="store_true")
    options = parser.parse_args()
    faces = []
    for name, identity in CAST:
        kept = options.keep / f"m_{name}_{identity}.npz" if options.keep else None
        if kept is not None and kept.is_file():
            read = dict(np.load(kept))
        else:
            read = draw_and_track(name, identity)
            if kept is not None:
                np.savez(kept, **read)
        faces.append(Tracked(read))
    table = learn(faces[0::2])
    print(report(faces[1::2], table))
    if options.page:
        before = options.page.read_text(encoding="utf-8").partition("\n| shape |")[0]
        options.page.write_text(f"{before}\n{report(faces[1::2], table)}\n", encoding="utf-8")
    if options.write:
        rows = ["\t".join(("measure", *READ_SHAPES))]
        rows += ["\t".join((name, *(f"{v:.3f}" for v in row))) for name, row in zip(MEASURES, table, strict=True)]
        path = Path(__file__).parents[2] / "tts2face" / "lips" / "upper_face.tsv"
        path.write_text("\n".join(rows) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
