"""Teeth, gums and tongue of the shipped heads: behind closed lips, apart behind open ones."""

import numpy as np
import pytest

from corpus_tools.shipped.head.tongue_out import give_way
from tests.face.posing import posed_vertices
from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.models.landmarks import INNER_LIP_UPPER, LOWER_LIP_INNER_MID, UPPER_LIP_INNER_MID
from tts2face.storage.shipped import find_file

FRONT_Z = 8.0  # mm; teeth further back are behind the cheeks


def weights(face: Face, shown: dict[str, float]) -> np.ndarray:
    plain = [name.removesuffix("Left").removesuffix("Right") for name in face.shape_names]
    return np.array([shown.get(name, shown.get(word, 0.0)) for name, word in zip(face.shape_names, plain, strict=True)])


def part_vertices(face: Face, *names: str) -> np.ndarray:
    used = [face.triangles[part.first : part.first + part.count] for part in face.parts if part.name in names]
    return np.unique(np.concatenate(used))


def uncovered(face: Face, posed: np.ndarray, inner: np.ndarray) -> np.ndarray:
    """(N,) whether no skin lies in front of the vertices `inner`, straight ahead."""
    skin = next(part for part in face.parts if part.name == "skin")
    corners = posed[face.triangles[skin.first : skin.first + skin.count]].astype(float)
    points = posed[inner].astype(float)
    low, high = points.min(axis=0) - 1, points.max(axis=0) + 1
    near = (corners[:, :, :2].max(axis=1) > low[:2]).all(axis=1) & (corners[:, :, :2].min(axis=1) < high[:2]).all(
        axis=1
    )
    a, b, c = corners[near & (corners[:, :, 2].max(axis=1) > low[2])].transpose(1, 0, 2)
    area = (b[:, 0] - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (b[:, 1] - a[:, 1])
    area = np.where(np.abs(area) < 1e-9, np.inf, area)
    covered = np.zeros(len(points), bool)
    for number, (x, y, z) in enumerate(points):
        one = ((x - a[:, 0]) * (c[:, 1] - a[:, 1]) - (c[:, 0] - a[:, 0]) * (y - a[:, 1])) / area
        two = ((b[:, 0] - a[:, 0]) * (y - a[:, 1]) - (x - a[:, 0]) * (b[:, 1] - a[:, 1])) / area
        inside = (one >= 0) & (two >= 0) & (one + two <= 1)
        depth = a[inside, 2] + one[inside] * (b - a)[inside, 2] + two[inside] * (c - a)[inside, 2]
        covered[number] = (depth > z).any()
    return ~covered


@pytest.fixture(scope="module")
def head() -> Face:
    return read_face(find_file("head", "face"))


def test_incisors_stand_just_behind_the_lips_in_an_arch(head: Face) -> None:
    lips = np.einsum("lk,lkd->ld", head.landmark_weights, head.vertices[head.landmark_vertices])
    line = lips[list(INNER_LIP_UPPER), 2].max()
    upper, lower = (head.vertices[part_vertices(head, f"teeth_{arch}")] for arch in ("upper", "lower"))
    assert 1.5 < line - upper[:, 2].max() < 3.5
    assert 1.5 < upper[:, 2].max() - lower[:, 2].max() < 4.5
    canine = upper[np.abs(np.abs(upper[:, 0]) - 17) < 2, 2].max()
    assert 4 < upper[:, 2].max() - canine < 12  # a real arch falls back by 8 to 9 mm


def test_the_arches_part_when_the_jaw_drops(head: Face) -> None:
    posed = posed_vertices(head, weights(head, {"jawOpen": 0.3}))
    upper, lower = (posed[part_vertices(head, f"teeth_{arch}")] for arch in ("upper", "lower"))
    front = [points[(np.abs(points[:, 0]) < 8) & (points[:, 2] > 8)] for points in (upper, lower)]
    assert front[0][:, 1].min() - front[1][:, 1].max() > 4


def tip(head: Face, shown: dict[str, float]) -> np.ndarray:
    """Mean of the foremost vertices of the tongue at rest, in a pose."""
    tongue = part_vertices(head, "tongue")
    foremost = tongue[np.argsort(-head.vertices[tongue, 2])[:20]]
    return posed_vertices(head, weights(head, shown))[foremost].mean(axis=0)


def test_the_tip_of_the_tongue_rises_to_the_ridge(head: Face) -> None:
    up = tip(head, {"jawOpen": 0.25, "tongueUp": 1.0})
    upper = head.vertices[part_vertices(head, "teeth_upper")]
    assert up[1] > upper[:, 1].min() + 2  # above the edges of the upper incisors
    assert up[2] < upper[:, 2].max() - 3  # behind them


def test_the_tip_of_the_tongue_comes_between_the_teeth(head: Face) -> None:
    shown = {"jawOpen": 0.2, "tongueOut": 0.5}
    between = tip(head, shown)
    posed = posed_vertices(head, weights(head, shown))
    upper, lower = (posed[part_vertices(head, f"teeth_{arch}")] for arch in ("upper", "lower"))
    assert between[2] > upper[:, 2].max() - 1
    front = lower[(np.abs(lower[:, 0]) < 8) & (lower[:, 2] > 8)]
    assert front[:, 1].max() - 1 < between[1] < upper[np.abs(upper[:, 0]) < 8, 1].min() + 1


def test_upper_lashes_lie_over_shut_lids(head: Face) -> None:
    lashes = part_vertices(head, "lashes")
    at_rest = head.vertices[lashes]
    shown = (at_rest[:, 2] > 0) & (at_rest[:, 1] > 4)
    moved = posed_vertices(head, weights(head, {"eyeBlink": 1.0}))[lashes][shown]
    height = np.ptp(moved[:, 1])
    assert height > 3  # edge-on they would have none
    assert moved[:, 1].mean() < at_rest[shown, 1].mean() - 8


@pytest.mark.parametrize("share", [0.6, 1.0])
def test_lips_give_way_to_the_tongue(head: Face, share: float) -> None:
    parted = give_way(head)
    posed = posed_vertices(parted, weights(parted, {"tongueOut": share}))
    lips = np.einsum("lk,lkd->ld", parted.landmark_weights, posed[parted.landmark_vertices])
    upper, lower = (lips[parted.landmarks == number][0] for number in (UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID))
    assert upper[1] - lower[1] > 4
    tongue = posed[part_vertices(parted, "tongue")]
    out = tongue[(tongue[:, 2] > lower[2] - 2) & (np.abs(tongue[:, 0]) < 5)]
    assert len(out) > 10
    assert lower[1] - 1 < out[:, 1].min() < lower[1] + 2  # on the lip, not in it
    assert give_way(parted) is parted
