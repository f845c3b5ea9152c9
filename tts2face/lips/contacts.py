"""Preservation of lip contacts, which averaging of exemplars would open."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.phones import look_up_phone
from tts2face.lips.tokens import Tokens
from tts2face.numeric.kernels import kernel


@dataclass(frozen=True, slots=True)
class ContactRule:
    """Definition of a lip contact.

    Parameters
    ----------
    pose_share
        Share of the exemplars, by weight and with the smallest gaps, whose average is the pose of the contact.
    enough
        Share of the exemplars whose largest gap is the threshold: only motion with a larger gap is corrected.
    """

    pose_share: float
    enough: float


# Chosen so that lips touch as often as in recordings (docs/decisions/039-phone-networks.md). Some bilabials close
# between two frames, so not all exemplars determine the pose. The gap of labiodentals varies: blending each to the mean
# would close those that were recorded open.
CONTACT_RULES = {
    "bilabial": ContactRule(pose_share=0.7, enough=0.0),
    "labiodental": ContactRule(pose_share=1.0, enough=0.75),
}
MANNERS_WITHOUT_CONTACT = frozenset({"approximant"})  # narrowed, not closed
CONTACT_MARGIN_S = 0.03  # a closure may lie this far outside its phone's edges (video frames are 40 ms, edges +- 10 ms)
CONTACT_HOLD_S = 0.03  # minimum duration of a contact; a shorter one can fall between two frames at 30 fps
LEAST_MOBILITY = (
    0.1  # of the largest; along other directions (sideways, in depth) lips hardly move and are not corrected
)
CONTACT_EASE_S = 0.05  # transition before and after; a longer one changes vowels (0.06: r of opening falls by .001)


@dataclass(frozen=True, slots=True, eq=False)
class LipGap:
    """Vector between two landmarks under a linear model: ``rest + parameters @ basis``, (3,) and (D, 3), in mm.

    ``change`` (3, D) is the least change of the parameters, in units of their spread, that changes the vector by 1 mm
    along each axis, as far as the talker's lips move along it.
    """

    rest: NDArray[np.float32]
    basis: NDArray[np.float32]
    change: NDArray[np.float32]

    @classmethod
    def with_spread(
        cls, rest: NDArray[np.float32], basis: NDArray[np.float32], spread: NDArray[np.floating]
    ) -> "LipGap":
        """The gap of parameters with standard deviations `spread` (D,)."""
        change = np.linalg.pinv(spread[:, None].astype(np.float64) * basis, rcond=LEAST_MOBILITY) * spread
        return cls(rest, basis, change.astype(np.float32))

    def vectors(self, parameters: NDArray[np.floating]) -> NDArray[np.float32]:
        """(T, 3) mm for (T, D) parameters."""
        return np.asarray(self.rest + parameters.astype(np.float32) @ self.basis)

    def of(self, parameters: NDArray[np.floating]) -> NDArray[np.float32]:
        """(T,) lengths in mm for (T, D) parameters."""
        return np.asarray(np.linalg.norm(self.vectors(parameters), axis=1))


def contact_rule(label: str) -> ContactRule | None:
    """Contact rule of a phone; None for a phone without lip contact."""
    phone = look_up_phone(label)
    return None if phone.manner in MANNERS_WITHOUT_CONTACT else CONTACT_RULES.get(phone.place)


def shown_contact(requested: str, shown: str) -> ContactRule | None:
    """Contact rule of the recorded phone that shows a requested one; None if the requested one has no such contact."""
    parts = look_up_phone(requested).parts or (requested,)
    rule = contact_rule(shown)
    return rule if rule in [contact_rule(part) for part in parts] else None


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """C lip contacts: spans (C, 2) of their phones in seconds, gaps (C, 3), and gap thresholds (C,), both in mm."""

    spans: NDArray[np.float64]
    gaps: NDArray[np.float32]
    enough: NDArray[np.float32]


@dataclass(frozen=True, slots=True, eq=False)
class ChosenExemplars:
    """The tokens (N, k) of a talker that were chosen for N phones, and their weights (N, k)."""

    tokens: Tokens
    chosen: NDArray[np.int32]
    weights: NDArray[np.float64]


def find_contacts(
    exemplars: ChosenExemplars, gap: LipGap, spans: NDArray[np.float64], rules: Sequence[ContactRule]
) -> Contacts:
    """Contacts of N phones with spans (N, 2) in seconds and one rule each.

    The gap is that of the average of the exemplars with the smallest gaps, each at its own frame of least gap. The
    other exemplars are excluded because a tenth of the recorded contacts falls between two frames or is missed by the
    alignment.
    """
    tokens = exemplars.tokens
    chosen = exemplars.chosen
    weights = exemplars.weights
    rows, squared = np.zeros(chosen.shape, np.int64), np.full(chosen.shape, np.inf)
    corpus = (tokens.frames, tokens.first_frame, tokens.utterance, tokens.spans, tokens.fps)
    _closest_rows(corpus, chosen, (gap.rest, gap.basis), rows, squared)
    order = np.argsort(squared, axis=1, kind="stable")
    sorted_weights = np.take_along_axis(weights, order, axis=1)
    closer_than = np.cumsum(sorted_weights, axis=1) - sorted_weights
    kept = np.zeros_like(weights)
    is_used = closer_than < np.array([rule.pose_share for rule in rules])[:, None]
    np.put_along_axis(kept, order, np.where(is_used, sorted_weights, 0.0), axis=1)
    kept /= kept.sum(axis=1, keepdims=True)
    mean_gaps = gap.vectors(np.einsum("nk,nkd->nd", kept, tokens.frames[rows]))
    present = (closer_than <= np.array([rule.enough for rule in rules])[:, None]) & (sorted_weights > 0)
    gaps = np.sqrt(np.take_along_axis(squared, order, axis=1))
    enough = np.where(present, gaps, 0.0).max(axis=1).astype(np.float32)
    return Contacts(spans, mean_gaps, np.maximum(enough, np.linalg.norm(mean_gaps, axis=1)))


@kernel
def _closest_rows(corpus, chosen, gap, rows, gaps):  # type: ignore[no-untyped-def]
    """Write, for each chosen token, the frame where its lips are closest, and their distance squared."""
    frames, first_frame, utterance, spans, fps = corpus
    for n in range(len(chosen)):
        for e in range(chosen.shape[1]):
            token = chosen[n, e]
            if token < 0:
                continue
            first, last = first_frame[utterance[token]], first_frame[utterance[token] + 1] - 1
            low = first + int(np.ceil((spans[token, 1] - CONTACT_MARGIN_S) * fps))
            high = first + int(np.floor((spans[token, 2] + CONTACT_MARGIN_S) * fps))
            low = min(max(low, first), last)
            rows[n, e], gaps[n, e] = _closest_row(frames, low, max(low, min(high, last)), gap)


@kernel
def _closest_row(frames, low, high, gap):  # type: ignore[no-untyped-def]
    """Row of [low, high] where the gap is least, and the gap squared."""
    rest, basis = gap
    closest, least = low, np.inf
    for row in range(low, high + 1):
        squared = 0.0
        for axis in range(3):
            apart = rest[axis]
            for d in range(len(basis)):
                apart += frames[row, d] * basis[d, axis]
            squared += apart * apart
        if squared < least:
            closest, least = row, squared
    return closest, least


def enforce_contacts(
    values: NDArray[np.float32], contacts: Contacts, gap: LipGap, rate_hz: float
) -> NDArray[np.float32]:
    """(T, D) values at `rate_hz` with the lip gap reduced to the threshold of each contact.

    Around the time of least gap, the gap is that of the contact for `CONTACT_HOLD_S`, with transitions of
    `CONTACT_EASE_S`; the parameters change as little as possible, so that the width of the lips follows the context.
    Contacts whose gap is below the threshold are unchanged.
    """
    kept = values.copy()
    times = np.arange(len(values)) / rate_hz
    for (start, end), closed, enough in zip(contacts.spans, contacts.gaps, contacts.enough, strict=True):
        low, high = np.searchsorted(times, (start - CONTACT_MARGIN_S, end + CONTACT_MARGIN_S))
        if low >= high:
            continue
        gaps = gap.of(kept[low:high])
        at = low + int(np.argmin(gaps))
        # closed already: left as recorded
        if gaps[at - low] <= enough:
            continue
        reach = int((CONTACT_HOLD_S / 2 + CONTACT_EASE_S) * rate_hz)
        here = slice(max(0, at - reach), min(len(kept), at + reach + 1))
        distance = np.maximum(np.abs(times[here] - times[at]) - CONTACT_HOLD_S / 2, 0.0) / CONTACT_EASE_S
        pull = (0.5 + 0.5 * np.cos(np.pi * np.minimum(distance, 1.0)))[:, None].astype(np.float32)
        kept[here] += pull * ((closed - gap.vectors(kept[here])) @ gap.change)
    return kept
