"""Visemes of phones in the inventories of Oculus, Azure and Rhubarb.

The data are in `visemes.tsv`, one phone per line; a cell with several visemes divides the phone into equal parts.
"""

import functools
from collections.abc import Iterator, Mapping
from importlib import resources
from types import MappingProxyType

from lexicon.phones import look_up_phone
from tts2face.interchange.exports.labels import Label

OCULUS = ("sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U")  # index = id
# Azure numbers its visemes 0 to 21
AZURE = tuple(str(number) for number in range(22))
RHUBARB = ("A", "B", "C", "D", "E", "F", "G", "H", "X")
INVENTORIES: Mapping[str, tuple[str, ...]] = MappingProxyType({"oculus": OCULUS, "azure": AZURE, "rhubarb": RHUBARB})


@functools.cache
def viseme_table(inventory: str) -> Mapping[str, tuple[str, ...]]:
    """Visemes of each phone in one of `INVENTORIES`."""
    lines = (
        resources.files("tts2face.interchange.exports").joinpath("visemes.tsv").read_text(encoding="utf-8").splitlines()
    )
    heading, *rows = [line.split("\t") for line in lines]
    column = heading.index(inventory)
    return MappingProxyType({row[0]: tuple(row[column].split()) for row in rows})


def viseme_labels(phone: Label, inventory: str) -> Iterator[Label]:
    """Visemes of a phone, in equal parts of its time.

    Raises
    ------
    InputError
        The phone is not in the phone table.
    """
    visemes = viseme_table(inventory)[look_up_phone(phone.text).symbol]
    step = (phone.end - phone.start) / len(visemes)
    for number, viseme in enumerate(visemes):
        end = phone.end if number + 1 == len(visemes) else phone.start + (number + 1) * step
        yield Label(viseme, phone.start + number * step, end)
