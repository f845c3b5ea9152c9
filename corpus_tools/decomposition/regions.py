"""Landmarks of the face's regions, as an editable table."""

import csv
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

REGION_TABLE = Path(__file__).with_name("regions.tsv")


def feature_landmarks(feature: str) -> NDArray[np.int32]:
    """Landmarks of all regions of a feature, such as both brows."""
    found = [row["landmarks"].split() for row in _read_rows() if row["feature"] == feature]
    return np.array([int(n) for part in found for n in part], np.int32)


def _read_rows() -> list[dict[str, str]]:
    lines = [line for line in REGION_TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    return list(csv.DictReader(lines, delimiter="\t"))
