"""Explanation of synthesised lip motion: the recorded tokens used for each phone."""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from lexicon.sequence import DOUBTFUL, SILENCE
from tts2face.lips.blending import exemplar_weights
from tts2face.lips.exemplar import ExemplarModel, TokenSelection


@dataclass(frozen=True, slots=True)
class UsedToken:
    """A recorded token used for a phone.

    ``start`` and ``end`` are seconds of the utterance; ``left`` and ``right`` are the neighbouring phones in temporal
    order; ``score`` is the context score, ``weight`` the weight in the average.
    """

    utterance: str
    start: float
    end: float
    left: tuple[str, ...]
    right: tuple[str, ...]
    score: float
    weight: float


@dataclass(frozen=True, slots=True)
class PhoneExplanation:
    """A phone, the recorded phone used for it, its context, and the tokens used, best first.

    ``shown`` differs from ``phone`` if the talker's recordings lack the phone. Phones without a lip shape (h) and
    silence far from speech use no token and are omitted. ``confidence`` is that of the word in a recording.
    """

    phone: str
    start: float
    end: float
    shown: str
    left: tuple[str, ...]
    right: tuple[str, ...]
    tokens: tuple[UsedToken, ...]
    confidence: float = 1.0


def explain_selection(selection: TokenSelection, exemplars: ExemplarModel) -> tuple[PhoneExplanation, ...]:
    """Recorded tokens used for each phone of a selection."""
    phones = selection.phones
    targets = selection.targets
    found = selection.found
    options = selection.options
    weights = exemplar_weights(found.scores, options.sharpness)
    padded = (SILENCE,) * options.context + targets.labels + (SILENCE,) * options.context
    shown = []
    for at, (label, source) in enumerate(zip(targets.labels, targets.source, strict=True)):
        here = at + options.context
        used = tuple(
            _token_record(exemplars, int(token), float(score), float(weight), options.context)
            for token, score, weight in zip(found.tokens[at], found.scores[at], weights[at], strict=True)
            if token >= 0
        )
        start, end = float(targets.spans[at, 1]), float(targets.spans[at, 2])
        left, right = padded[at:here], padded[here + 1 : here + 1 + options.context]
        shown.append(PhoneExplanation(phones.phones[source], start, end, label, left, right, used))
    return tuple(shown)


def _token_record(exemplars: ExemplarModel, token: int, score: float, weight: float, n_context: int) -> UsedToken:
    tokens = exemplars.tokens
    around = [tokens.inventory[number] for number in tokens.context[token, : 2 * n_context]]
    _, start, end, _ = np.round(tokens.spans[token], 4).tolist()
    name = exemplars.names[tokens.utterance[token]]
    return UsedToken(name, start, end, tuple(around[0::2][::-1]), tuple(around[1::2]), score, weight)


def explanation_json(shown: tuple[PhoneExplanation, ...]) -> list[dict[str, Any]]:
    """The explanation as lists and dictionaries for JSON."""
    return [asdict(phone) for phone in shown]


def explanation_text(shown: tuple[PhoneExplanation, ...], *, n_tokens: int = 5) -> str:
    """The explanation as text, one paragraph for each phone with its best `n_tokens` tokens."""
    lines = []
    for phone in shown:
        name = phone.phone if phone.phone == phone.shown else f"{phone.phone} (shown by {phone.shown})"
        around = f"{' '.join(phone.left)} [{phone.shown}] {' '.join(phone.right)}"
        doubt = "" if phone.confidence >= DOUBTFUL else f"  doubtful ({phone.confidence:.2f})"
        lines.append(f"{phone.start:8.3f}-{phone.end:.3f} s  {name}  in  {around}{doubt}")
        lines += [
            f"    {used.score:6.3f} x {used.weight:.2f}  {used.utterance} {used.start:.2f}-{used.end:.2f} s  "
            f"{' '.join(used.left)} [{phone.shown}] {' '.join(used.right)}"
            for used in phone.tokens[:n_tokens]
        ]
    return "\n".join(lines) + "\n"
