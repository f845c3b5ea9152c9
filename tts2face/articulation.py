"""Articulation: how far the mouth rounds, spreads and opens, as a name or a factor."""

from lexicon.errors import InputError
from lexicon.values.checks import check_limits

NATURAL, CLEAR = 1.0, 1.5
ARTICULATIONS = {"natural": NATURAL, "clear": CLEAR}
ARTICULATION_LIMITS = (0.5, 2.0)


def parse_articulation(given: str) -> float:
    """Factor of an articulation: natural, clear, or a number.

    Raises
    ------
    InputError
        It is neither a name nor a number from 0.5 to 2.
    """
    if given in ARTICULATIONS:
        return ARTICULATIONS[given]
    try:
        factor = float(given)
    except ValueError:
        raise InputError(f"articulation must be natural, clear or a factor from 0.5 to 2, not {given!r}") from None
    check_limits("articulation", factor, ARTICULATION_LIMITS)
    return factor
