"""Marker capture with a known answer: the head's own landmarks, moved by a real capture, seen in other axes."""

import warnings
from dataclasses import dataclass
from math import isnan
from pathlib import Path

import c3d
import numpy as np

from corpus_tools.decomposition.marker_sets import MarkerSet
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
    path: Path,
    names: tuple[str, ...],
    points: np.ndarray,
    *,
    units: str = "mm",
    sound: np.ndarray | None = None,
    scale: float = -1.0,
) -> Path:
    """Points (T, M, 3) in `units` at `FPS`, NaN where hidden; sound (T k,) with k samples a frame, all by py-c3d.

    Numbers are floats, or with a positive `scale` whole multiples of it.
    """
    n_samples = 0 if sound is None else len(sound) // len(points)
    writer = c3d.Writer(point_rate=FPS, analog_rate=FPS * n_samples, point_scale=scale, point_units=units)
    for number, first in enumerate(range(0, len(names), 255), start=1):
        some = [f"Anna:{name}" for name in names[first : first + 255]]
        text, length = writer.pack_labels(some)
        writer.point_group.add_str(f"LABELS{number if number > 1 else ''}", "", text, length, len(some))
    writer.point_group.add_str("DESCRIPTIONS", "", " ", 1, 1)  # by default one a marker, of at most 255
    if sound is not None:
        writer.set_analog_labels(["Force.Fx", "Audio.1"])
        writer.analog_group.add_str("FORMAT", "", "SIGNED  ", 8)
    rows = np.zeros((*points.shape[:2], 5))
    rows[..., :3] = np.nan_to_num(points)
    rows[np.isnan(points).any(axis=2), 3:] = -1
    channels = np.zeros((len(points), 2 * (n_samples > 0), n_samples))
    if sound is not None:
        channels[:, 1] = sound.reshape(len(points), n_samples)
    writer.add_frames(list(zip(rows, channels, strict=True)))
    with path.open("wb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # it tells that there are no channels
        writer.write(file)
    return path


def write_table(path: Path, names: tuple[str, ...], points: np.ndarray, first: str = "time") -> Path:
    """Points (T, M, 3) in mm; gaps are empty cells."""
    header = [first, *(f"{name}_{axis}" for name in names for axis in "xyz")]
    lines = [",".join(header)]
    for frame, row in enumerate(points.reshape(len(points), -1).tolist()):
        at = f"{frame / FPS:.4f}" if first == "time" else str(frame + 1)
        lines.append(",".join([at, *("" if isnan(value) else f"{value:.5f}" for value in row)]))
    path.write_text("\n".join(lines) + "\n")
    return path
