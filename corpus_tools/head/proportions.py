"""Proportions of people: weights of MakeHuman's modelling targets, by which a person differs from the macro targets.

They were solved for nineteen proportions that the face tracker reads from rendered stills, as it reads them from filmed
people, and then chosen by eye (docs/decisions/169-friendlier-identities.md).
"""

import csv
from collections.abc import Mapping
from pathlib import Path

TABLE = Path(__file__).with_name("proportions.csv")
BOTH_SIDES = "*"  # in the name of a target that the left and the right half of the face have


def modelling_targets(person: str) -> dict[str, float]:
    """Weight of each modelling target of a person; rows of the table with a negative weight name the opposite one."""
    found: dict[str, float] = {}
    with TABLE.open(newline="") as file:
        for row in csv.DictReader(file):
            weight = float(row[person] or 0)
            name = row["target"] + (row["more"] if weight > 0 else row["less"])
            sides = ("l", "r") if BOTH_SIDES in name else ("",)
            found |= {name.replace(BOTH_SIDES, side): abs(weight) for side in sides if weight}
    return found


def add_targets(one: Mapping[str, float], other: Mapping[str, float]) -> dict[str, float]:
    """Sums of the weights of two sets of targets."""
    return {name: one.get(name, 0.0) + other.get(name, 0.0) for name in {**one, **other}}
