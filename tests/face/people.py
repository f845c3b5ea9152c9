"""The shipped people, for tests that look at each of them; by default a run looks at the plain head alone."""

import pytest

from tts2face.catalogue import identities

DRAWN = ("ada", "ben", "noor", "zuri")
PEOPLE = [  # face and identity
    pytest.param("head", None, marks=pytest.mark.smoke, id="head"),
    *(pytest.param(name, None, id=name) for name in DRAWN),
    *(pytest.param("head", entry.name, id=entry.name) for entry in identities("head")),
]
