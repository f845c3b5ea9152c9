"""Conversion of a phone sequence to phones of the talker's recordings."""

import functools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import nearest_phones
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.tokens import PAUSE_REACH_S, spans_with_reach

# Glottal sounds have no lip shape: lips and tongue are already in the position of the next phone.
TRANSPARENT_PHONES = frozenset({"h", "ɦ", "ʔ"})
MIN_TARGET_GAP_S = 1e-6  # between targets: less is rounding
TargetRow = tuple[str, float, float, int]  # label, start, end, index of the requested phone


@dataclass(frozen=True, slots=True, eq=False)
class Targets:
    """N phones of the talker's inventory, in temporal order.

    Parameters
    ----------
    labels : N labels
    spans : (N, 4)
        Seconds, as in `tts2face.lips.tokens.Tokens`; parts of silence far from speech belong to no target.
    source : (N,)
        Index of the requested phone that each one replaces.
    """

    labels: tuple[str, ...]
    spans: NDArray[np.float64]
    source: NDArray[np.int64]


@functools.lru_cache(maxsize=4096)
def substitute_phones(label: str, inventory: tuple[str, ...]) -> tuple[str, ...]:
    """Phones of the inventory for a phone: itself, the nearest, or those of its parts; none for a transparent one."""
    # h, ɦ and ʔ give their time to the next phone (decision 004)
    if label not in inventory and label in TRANSPARENT_PHONES:
        return ()
    return nearest_phones(label, inventory)


def build_targets(phones: PhoneSequence, inventory: tuple[str, ...]) -> Targets:
    """Targets of a phone sequence.

    The time of a transparent phone is assigned to the next phone, or before silence to the last one. A
    silence between speech that is longer than two reaches becomes two targets, one after the speech and one before it.

    Raises
    ------
    InputError
        A label is not in the phone table, or the inventory has no phone but silence.
    """
    rows = _substitution_rows(phones, inventory)
    rows = [part for at, row in enumerate(rows) for part in _cut_to_speech(row, at > 0, at + 1 < len(rows))]
    starts, ends = np.array([row[1] for row in rows]), np.array([row[2] for row in rows])
    return Targets(
        tuple(row[0] for row in rows), spans_with_reach(starts, ends), np.array([row[3] for row in rows], np.int64)
    )


def target_phones(targets: Targets) -> PhoneSequence:
    """The targets as phones in time from 0 s on, with silence where there is none; a pause is one phone."""
    labels: list[str] = []
    edges = [0.0]

    def extend(label: str, end: float) -> None:
        if labels and label == labels[-1] == SILENCE:
            edges[-1] = end
            return
        labels.append(label)
        edges.append(end)

    for label, (start, end) in zip(targets.labels, targets.spans[:, 1:3], strict=True):
        if start - edges[-1] > MIN_TARGET_GAP_S:
            extend(SILENCE, float(start))
        extend(label, float(end))
    return PhoneSequence(labels, edges)


def _substitution_rows(phones: PhoneSequence, inventory: tuple[str, ...]) -> list[TargetRow]:
    rows: list[TargetRow] = []
    waiting: float | None = None  # onset of a transparent phone
    for at, label in enumerate(phones.phones):
        start, end = float(phones.edges[at]), float(phones.edges[at + 1])
        shown = substitute_phones(label, inventory)
        if not shown:
            waiting = start if waiting is None else waiting
            continue
        # before a pause to the last one, whose position the lips have
        if waiting is not None and label == SILENCE and rows:
            rows[-1] = (rows[-1][0], rows[-1][1], start, rows[-1][3])
        elif waiting is not None:
            start = waiting
        waiting = None
        cuts = np.linspace(start, end, len(shown) + 1)
        rows += [(part, float(cuts[i]), float(cuts[i + 1]), at) for i, part in enumerate(shown)]
    if waiting is not None:
        rows.append((SILENCE, waiting, phones.end, len(phones) - 1))
    return rows


def _cut_to_speech(row: TargetRow, behind_speech: bool, before_speech: bool) -> list[TargetRow]:
    label, start, end, source = row
    if label != SILENCE or end - start <= PAUSE_REACH_S:
        return [row]
    parts = []
    if behind_speech and before_speech and end - start <= 2 * PAUSE_REACH_S:
        return [row]
    if behind_speech:
        parts.append((label, start, start + PAUSE_REACH_S, source))
    if before_speech:
        parts.append((label, end - PAUSE_REACH_S, end, source))
    return parts or [row]
