"""Statements of where recordings are from and under which licence they are, in a JSON file beside them."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from lexicon.errors import DataError
from lexicon.values.json_text import read_json

PROVENANCE = "provenance.json"  # in the folder of recordings: their sources and licence
PROVENANCE_FIELDS = ("name", "language", "sources", "licence", "attribution")


def read_provenance(path: Path, *, must_exist: bool) -> Mapping[str, Any]:
    """Provenance of recordings: a JSON object with any of name, language, sources, licence and attribution.

    Raises
    ------
    DataError
        The file is missing but must exist, is not a JSON object, or has other fields.
    """
    if not must_exist and not path.is_file():
        return {}
    try:
        stated = read_json(path)
    except OSError as refused:
        raise DataError(f"{path} cannot be read ({refused.strerror}); check the path") from refused
    if not isinstance(stated, dict) or not set(stated) <= set(PROVENANCE_FIELDS):
        raise DataError(f"{path} must be a JSON object with fields out of {', '.join(PROVENANCE_FIELDS)}")
    return stated
