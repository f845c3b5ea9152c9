"""Marker capture with a known answer: the head's own landmarks, moved by a real capture, seen in other axes."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from corpus_tools.decomposition.markers import MarkerSet
from tts2face.face.deformation import head_transform
from tts2face.models.face import Face

FPS = 120.0
SIZE = 0.94  # of the made person over the head
# On the skull, mm from between the eyeballs: crown, forehead's band, sides.
SKULL = np.array(
    [(0, 95, -60), (45, 80, -10), (-45, 80, -10), (70, 40, -70), (-70, 40, -70), (30, 90, -110), (-35, 85, -115)], float
)


@dataclass(frozen=True, slots=True, eq=False)
class Made:
    """Points (T, M, 3) in mm of the world by the names of a marker set, and what made them."""

    names: tuple[str, ...]
    points: np.ndarray
    landmarks: np.ndarray
    head: np.ndarray


def world_turn() -> np.ndarray:
    """(3, 3): the capture's axes are not the face's."""
    turn, _ = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def made_take(landmarks: np.ndarray, head: np.ndarray, face: Face, marker_set: MarkerSet) -> Made:
    """A person `SIZE` times as large as the head, from landmarks (T, 478, 3) and head poses (T, 6)."""
    on_face = landmarks[:, list(marker_set.landmarks.values())]
    still = np.repeat(SKULL[None, : len(marker_set.head)], len(landmarks), axis=0)
    points = np.concatenate([on_face, still], axis=1) * SIZE
    turn, place = world_turn(), np.array([300.0, -1200.0, 90.0])
    seen = np.zeros_like(points)
    for frame, pose in enumerate(head):
        moved = head_transform(pose, face.pivot * SIZE).astype(float)
        seen[frame] = (points[frame] @ moved[:, :3].T + moved[:, 3]) @ turn.T + place
    return Made((*marker_set.landmarks, *marker_set.head), seen, landmarks * SIZE, head)


def write_c3d(
    path: Path, names: tuple[str, ...], points: np.ndarray, *, units: str = "mm", sound: np.ndarray | None = None
) -> Path:
    """Points (T, M, 3) in `units` at `FPS`; sound (T k,) with k samples a frame."""
    import ezc3d

    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [FPS]
    file["parameters"]["POINT"]["LABELS"]["value"] = tuple(f"Anna:{name}" for name in names)
    file.add_parameter("POINT", "UNITS", [units])
    rows = np.ones((4, len(names), len(points)))
    rows[:3] = points.transpose(2, 1, 0)
    file["data"]["points"] = rows
    if sound is not None:
        file["parameters"]["ANALOG"]["RATE"]["value"] = [FPS * len(sound) / len(points)]
        file["parameters"]["ANALOG"]["LABELS"]["value"] = ("Force.Fx", "Audio.1")
        file["data"]["analogs"] = np.stack([np.zeros_like(sound), sound])[None]
    file.write(str(path))
    return path


def write_table(path: Path, names: tuple[str, ...], points: np.ndarray, first: str = "time") -> Path:
    """Points (T, M, 3) in mm; gaps are empty cells."""
    header = [first, *(f"{name}_{axis}" for name in names for axis in "xyz")]
    lines = [",".join(header)]
    for frame, row in enumerate(points.reshape(len(points), -1)):
        at = f"{frame / FPS:.4f}" if first == "time" else str(frame + 1)
        lines.append(",".join([at, *("" if np.isnan(value) else f"{value:.5f}" for value in row)]))
    path.write_text("\n".join(lines) + "\n")
    return path
