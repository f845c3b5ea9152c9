"""The shipped haircuts on the shipped people."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.face.test_mouth import part_vertices
from tts2face.catalogue import identities
from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.models.hair import Hair, fit_hair
from tts2face.models.hair_file import haircut_names, load_hair
from tts2face.storage.files import find_file

PEOPLE = ("", "amara", "kofi", "mei", "walter", "nia")
SOLID = 80  # coverage, of 255, from which a card hides what is behind it
EYE_MM = 13.0  # half the width of an eye's opening
N_SAMPLES = 20_000
ALL_HAIR = tuple(haircut_names())


@pytest.fixture(scope="module")
def people() -> dict[str, Face]:
    head = find_file("head", "face")
    return {name: read_face(head, name or None) for name in PEOPLE}


def solid_points(hair: Hair, vertices: np.ndarray) -> np.ndarray:
    """(S, 3) random points on the cards where they are solid."""
    rng = np.random.default_rng(5)
    corners = vertices[hair.triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    chosen, weights = rng.choice(len(area), N_SAMPLES, p=area / area.sum()), rng.dirichlet(np.ones(3), N_SAMPLES)
    uv = np.einsum("sk,skd->sd", weights, hair.uv[hair.triangles[chosen]])
    texel = np.clip((uv * len(hair.alpha)).astype(int), 0, len(hair.alpha) - 1)
    points = np.einsum("sk,skd->sd", weights, corners[chosen])
    return points[hair.alpha[texel[:, 1], texel[:, 0]] > SOLID]


@pytest.mark.smoke
def test_there_are_ten_and_cropped() -> None:
    assert len(ALL_HAIR) == 11
    assert "cropped" in ALL_HAIR


@pytest.mark.parametrize("name", ALL_HAIR)
def test_no_haircut_hangs_before_an_eye(name: str, people: dict[str, Face]) -> None:
    hair = load_hair(name)
    for person, face in people.items():
        points = solid_points(hair, fit_hair(face, hair))
        for eye in face.eyes:
            off = points - eye.centre
            hides = (np.abs(off[:, 0]) < EYE_MM) & (np.abs(off[:, 1]) < EYE_MM / 2) & (off[:, 2] > 0)
            assert not hides.any(), f"{person}: {hides.sum()} points before the eye at x = {eye.centre[0]:.0f}"


@pytest.mark.parametrize("name", ALL_HAIR)
def test_the_scalp_has_the_colour_of_the_hair(name: str, people: dict[str, Face]) -> None:
    hair, face = load_hair(name), people[""]
    skin = part_vertices(face, "skin")
    crown = skin[(face.vertices[skin, 1] > 70) & (face.vertices[skin, 2] < -60)]
    texel = (face.uv[crown] * (np.array(hair.scalp.shape[::-1]) - 1)).astype(int)
    cover = hair.scalp[texel[:, 1], texel[:, 0]]
    assert (cover > (90 if name == "cropped" else 180)).mean() > 0.97
    brows = skin[(np.abs(face.vertices[skin, 1]) < 35) & (face.vertices[skin, 2] > 10)]
    below = (face.uv[brows] * (np.array(hair.scalp.shape[::-1]) - 1)).astype(int)
    assert hair.scalp[below[:, 1], below[:, 0]].max() == 0  # the face stays clear


@pytest.mark.parametrize("name", ALL_HAIR)
def test_hair_stays_about_the_head_of_every_person(name: str, people: dict[str, Face]) -> None:
    """Anchors move the hair as they move the skin: its distance from the skin stays what it is on the default head."""
    hair = load_hair(name)
    skin = part_vertices(people[""], "skin")
    usual = cKDTree(people[""].vertices[skin]).query(hair.vertices)[0]
    close = usual < 15
    for person, face in people.items():
        own = cKDTree(face.vertices[skin]).query(fit_hair(face, hair)[close])[0]
        assert np.abs(own - usual[close]).mean() < 2.5, person


def test_every_person_has_hair_of_the_shipped() -> None:
    path = find_file("head", "face")
    cuts = {read_face(path, entry.name).hairdo.haircut for entry in identities()}
    assert cuts <= {*ALL_HAIR, "bald"}
    assert len(cuts) >= 7
    assert read_face(path).hairdo.haircut == "long01"
