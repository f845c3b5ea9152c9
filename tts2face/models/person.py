"""Sex and age of the person whom a face shows, by which a voice is chosen, and the default seed of a face."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any
from zlib import crc32

from lexicon.errors import InputError
from tts2face.request import DRAWN_FACE, OWN_FACE, REALISTIC_FACE

FEMALE, MALE = "female", "male"
PERSON = "person"  # key of the metadata of a face of a user: sex and age, as `parse_person` reads them
OLDEST = 120
SEEDS = 1_000_000  # default seeds are short numbers, which people may read and type


@dataclass(frozen=True, slots=True)
class Person:
    """Sex, `FEMALE` or `MALE`, and age in years."""

    sex: str
    age: float = 30.0

    def __str__(self) -> str:
        """Sex and age as `parse_person` reads them."""
        return f"{self.sex} {self.age:g}"

    @property
    def noun(self) -> str:
        """Words for such a person."""
        if self.age < GROWN_UP:
            return f"{_CHILDREN[self.sex]} of {self.age:g}"
        return ("an old " if self.age >= OLD else "a ") + ("woman" if self.sex == FEMALE else "man")


GROWN_UP, OLD = 16.0, 65.0  # years
_CHILDREN: Mapping[str, str] = MappingProxyType({FEMALE: "a girl", MALE: "a boy"})
WORDS: Mapping[str, Person] = MappingProxyType({
    "female": Person(FEMALE), "woman": Person(FEMALE), "girl": Person(FEMALE, 9.0),
    "male": Person(MALE), "man": Person(MALE), "boy": Person(MALE, 9.0),
})  # fmt: skip
_WRITTEN = re.compile(r"\s*([a-z]+)(?:[\s,:]+(\d{1,3}))?\s*", re.IGNORECASE)
# Shipped faces, and presets of the head, as their summaries describe them.
SHIPPED_PEOPLE: Mapping[tuple[str, str | None], Person] = MappingProxyType({
    ("ada", None): Person(FEMALE, 25), ("ben", None): Person(MALE, 25), ("mara", None): Person(FEMALE, 30),
    ("noor", None): Person(FEMALE, 75), ("tomas", None): Person(MALE, 35), ("zuri", None): Person(FEMALE, 8),
    (REALISTIC_FACE, None): Person(FEMALE, 30), (REALISTIC_FACE, "erik"): Person(MALE, 30),
    (REALISTIC_FACE, "amara"): Person(FEMALE, 30), (REALISTIC_FACE, "kofi"): Person(MALE, 35),
    (REALISTIC_FACE, "mei"): Person(FEMALE, 28), (REALISTIC_FACE, "leila"): Person(FEMALE, 35),
    (REALISTIC_FACE, "ravi"): Person(MALE, 30), (REALISTIC_FACE, "ingrid"): Person(FEMALE, 70),
    (REALISTIC_FACE, "nia"): Person(FEMALE, 9),
})  # fmt: skip
_FOREIGN = ("character", "consent", PERSON)  # keys of the metadata of a face that is not shipped, whatever its name


def parse_person(written: str) -> Person:
    """Person of a sex and an age: ``female``, ``man 70``, ``girl``.

    Raises
    ------
    InputError
        The sex is unknown, or nobody is as old.
    """
    found = _WRITTEN.fullmatch(written)
    known = found and WORDS.get(found[1].lower())
    if not found or not known or int(found[2] or 0) > OLDEST:
        raise InputError(f"a person is {', '.join(WORDS)}, with an age if it is known (woman 70), not {written[:40]!r}")
    return Person(known.sex, float(found[2])) if found[2] else known


def person_of(metadata: Mapping[str, Any]) -> Person | None:
    """Person whom the metadata of a face name, or of a shipped face; None where nothing is known."""
    stated = metadata.get(PERSON)
    if isinstance(stated, str):
        try:
            return parse_person(stated)
        except InputError:  # a file of another version
            return None
    if any(key in metadata for key in _FOREIGN):
        return None
    return SHIPPED_PEOPLE.get((str(metadata.get("name", "")), metadata.get("identity")))


def seed_of(metadata: Mapping[str, Any]) -> int:
    """Default seed of a face, by its name and identity, so that no two blink at once; 0 for the face of a default."""
    name = f"{metadata.get('name', OWN_FACE)} {metadata.get('identity') or ''}".strip()
    return (crc32(name.encode()) ^ crc32(DRAWN_FACE.encode())) % SEEDS
