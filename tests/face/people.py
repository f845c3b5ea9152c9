"""The shipped people, for tests that look at each of them; by default a run looks at the plain head alone."""

import pytest

from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.session.catalogue import identities

DRAWN = ("ada", "ben", "noor", "zuri")
REALISTIC = ("mara", "tomas")
LIT = (*DRAWN, *REALISTIC)
PEOPLE = [  # face and identity
    pytest.param("head", None, marks=pytest.mark.smoke, id="head"),
    *(pytest.param(name, None, id=name) for name in LIT),
    *(pytest.param("head", entry.name, id=entry.name) for entry in identities("head")),
]


def load_plain(name: str, person: str | None = None) -> Face:
    """A shipped face without hair cards; drawn characters keep their hair, which is a part of them."""
    return load_face(name, person, hair="bald" if name == "head" else None)
