"""Proportions of people: weights of MakeHuman's modelling targets, by which a person differs from the macro targets.

They were solved for nineteen proportions that the face tracker reads from rendered stills, as it reads them from filmed
people, and then chosen by eye (docs/decisions/014-built-faces.md).
"""

import csv
from collections.abc import Mapping
from pathlib import Path

from lexicon.values.toml_text import parse_toml

TABLE = Path(__file__).with_name("proportions.csv")  # people of the shipped head
TARGETS = Path(__file__).parents[1] / "targets.toml"  # the reference person, and drawn characters
BOTH_SIDES = "*"  # in the name of a target that the left and the right half of the face have


def modelling_targets(person: str) -> dict[str, float]:
    """Weight of each modelling target of a person; rows of the table with a negative weight name the opposite one."""
    found: dict[str, float] = {}
    with TABLE.open(newline="") as file:
        for row in csv.DictReader(file):
            weight = float(row[person] or 0)
            name = row["target"] + (row["more"] if weight > 0 else row["less"])
            if weight:
                found |= dict.fromkeys(_both_sides(name), abs(weight))
    return found


def person_targets(person: str) -> dict[str, float]:
    """Weight of each target of a person of `TARGETS`, macro targets among them, in the order of the table."""
    weights = parse_toml(TARGETS.read_text(encoding="utf-8"), TARGETS.name)[person]
    return {target: weight for name, weight in weights.items() for target in _both_sides(name)}


def _both_sides(name: str) -> list[str]:
    return [name.replace(BOTH_SIDES, side) for side in ("l", "r")] if BOTH_SIDES in name else [name]


def add_targets(own: Mapping[str, float], other: Mapping[str, float]) -> dict[str, float]:
    """Sums of the weights of two sets of targets."""
    return {name: own.get(name, 0.0) + other.get(name, 0.0) for name in {**own, **other}}
