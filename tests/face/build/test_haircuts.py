"""The shipped haircuts on the shipped people."""

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.face.people import DRAWN
from tests.face.test_mouth import part_vertices
from tts2face.models.face import Face
from tts2face.models.face_file import read_face
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import haircut_names
from tts2face.models.hair import Hair, fit_hair
from tts2face.models.hair_file import load_hair
from tts2face.models.lit_hair import SWING_SHAPES
from tts2face.session.catalogue import haircuts, identities
from tts2face.storage.shipped import SHIPPED_FOLDER, find_file

PEOPLE = ("", "amara", "kofi", "mei", "ingrid", "nia")
SOLID = 80  # coverage, of 255, from which a card hides what is behind it
EYE_MM = 13.0  # half the width of an eye's opening
N_SAMPLES = 20_000
ALL_HAIR = tuple(haircut_names())
DRAWN_HAIR = [(face, name) for face in DRAWN for name in haircut_names(face)]
STILL = ("curls", "afro")  # of which nothing is loose
MOST_BYTES = 1_600_000  # of a drawn character's haircut


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
def test_there_are_ten_of_the_package_and_seven_more() -> None:
    assert len(ALL_HAIR) == 17
    assert {"cropped", "stubble", "curly01", "curly02", "wavy01", "wavy02", "fringe01"} <= set(ALL_HAIR)


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
    assert (cover > {"cropped": 90, "stubble": 45}.get(name, 180)).mean() > 0.97
    brows = skin[(np.abs(face.vertices[skin, 1]) < 35) & (face.vertices[skin, 2] > 10)]
    below = (face.uv[brows] * (np.array(hair.scalp.shape[::-1]) - 1)).astype(int)
    assert hair.scalp[below[:, 1], below[:, 0]].max() == 0  # the face stays clear


@pytest.mark.parametrize("name", ALL_HAIR)
def test_hair_stays_about_the_head_of_every_person(name: str, people: dict[str, Face]) -> None:
    """Anchors move the hair as they move the skin: its distance from the skin stays what it is on the default head."""
    hair = load_hair(name)
    skin = part_vertices(people[""], "skin")
    usual = cKDTree(people[""].vertices[skin]).query(fit_hair(people[""], hair))[0]
    close = usual < 15
    for person, face in people.items():
        own = cKDTree(face.vertices[skin]).query(fit_hair(face, hair)[close])[0]
        assert np.abs(own - usual[close]).mean() < 2.5, person


def test_every_person_has_hair_of_the_shipped() -> None:
    path = find_file("head", "face")
    cuts = {read_face(path, entry.name).hairdo.haircut for entry in identities()}
    assert cuts <= {*ALL_HAIR, "bald"}
    assert len(cuts) >= 6
    assert read_face(path).hairdo.haircut == "bob02"


@pytest.mark.smoke
def test_every_drawn_character_has_three_haircuts() -> None:
    assert {face: 1 + len(haircut_names(face)) for face in DRAWN} == dict.fromkeys(DRAWN, 3)
    listed = [(one.face, one.name) for one in haircuts()]
    assert all(pair in listed for pair in [*DRAWN_HAIR, ("ada", "bob"), ("zuri", "puffs"), ("head", "bald")])
    assert len(set(listed)) == len(listed)


@pytest.mark.parametrize(("name", "haircut"), [pytest.param(*DRAWN_HAIR[0], marks=pytest.mark.smoke), *DRAWN_HAIR[1:]])
def test_haircuts_of_drawn_characters(name: str, haircut: str) -> None:
    assert (SHIPPED_FOLDER / f"{name}-{haircut}.hair").stat().st_size < MOST_BYTES
    own, face = load_face(name), load_face(name, hair=haircut, hair_color="auburn")
    n = int(face.triangles[face.parts[-1].first :].min())
    assert np.array_equal(face.vertices[:n], own.vertices[:n])
    hair = face.vertices[face.triangles[face.parts[-1].first :]].mean(axis=1)
    for eye in face.eyes:
        off = hair - eye.centre
        hides = (np.abs(off[:, 0]) < EYE_MM) & (np.abs(off[:, 1]) < EYE_MM / 2) & (off[:, 2] > 0)
        assert not hides.any()
    assert all(face.shapes[face.shape_names.index(shape), n:].any() for shape in SWING_SHAPES) == (haircut not in STILL)
    light = face.light.baked
    assert light.triangle_numbers.max() < len(face.triangles)
    assert np.isin(np.arange(face.parts[-1].first, len(face.triangles)), light.triangle_numbers).mean() > 0.3
    assert np.abs(light.pages[1].astype(int) - own.light.baked.pages[1]).mean() > 3  # another haircut, in red
    red, green, blue = light.pages[1][: len(light.pages[1]) // 2].mean(axis=(0, 1))
    assert red > 1.3 * green > 1.3 * blue
