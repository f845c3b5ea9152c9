"""Table of landmark positions of a character (TSV), in the units and axes of its file."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text
from tts2face.models.landmarks import (
    N_LANDMARKS,
)
from tts2face.numeric.arrays import FloatArray

COLUMNS = ("landmark", "x", "y", "z")
# 478 rows take 20 kB
MAX_TABLE_BYTES = 1_000_000
# in the units of the file
MAX_COORDINATE = 1e6


def landmark_table(places: Mapping[int, FloatArray]) -> str:
    """Positions (3,) of landmarks as the text of a TSV file."""
    rows = ["\t".join([str(number), *(f"{value:.6g}" for value in place)]) for number, place in sorted(places.items())]
    return "\n".join(["\t".join(COLUMNS), *rows]) + "\n"


def read_landmark_table(path: Path) -> dict[int, FloatArray]:
    """Positions (3,) of the landmarks of a TSV file."""
    try:
        lines = read_text(path, MAX_TABLE_BYTES).splitlines()
    except OSError as refused:
        raise InputError(f"cannot read the landmarks {path}: {refused.strerror}; check the path") from refused
    places: dict[int, FloatArray] = {}
    for row, line in enumerate(lines, 1):
        cells = [cell.strip() for cell in line.split("\t")]
        if not line.strip() or line.startswith("#") or tuple(cells) == COLUMNS:
            continue
        number, place = _row(cells, f"{path}, line {row}")
        if number in places:
            raise DataError(f"{path}, line {row}: the landmark {number} occurs twice; remove one of its rows")
        places[number] = place
    if not places:
        raise DataError(f"{path} has no landmark; give rows of landmark, x, y and z, separated by tabs")
    return places


def _row(cells: list[str], place: str) -> tuple[int, FloatArray]:
    try:
        number, *values = (int(cells[0]), *(float(cell) for cell in cells[1:]))
    except ValueError as error:
        raise DataError(f"{place}: {error}; give landmark, x, y and z as numbers") from error
    if len(values) != 3 or not 0 <= number < N_LANDMARKS:
        raise DataError(f"{place}: give a landmark of 0 to {N_LANDMARKS - 1} and its x, y and z")
    position = np.array(values, np.float64)
    if not (np.abs(position) <= MAX_COORDINATE).all():
        raise DataError(f"{place}: a coordinate is not finite or beyond {MAX_COORDINATE:g}; correct it")
    return number, position
