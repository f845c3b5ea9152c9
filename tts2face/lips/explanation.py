"""Explanation of synthesised lip motion: the recorded tokens used for each phone.

Outlines of lips, recorded or made, for drawing.

Measures of the similarity of two motions of the lips, as functions of arrays.
"""

from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.sequence import DOUBTFUL, SILENCE, PhoneSequence
from tts2face.lips.blending import exemplar_weights, frame_distances, path_cost, warp_path
from tts2face.lips.exemplar import ExemplarModel, TokenSelection
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import interpolate_columns


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
    phones, targets, found, options = selection.phones, selection.targets, selection.found, selection.options
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


OUTER = (*OUTER_LIP_UPPER, *reversed(OUTER_LIP_LOWER[1:-1]))  # from the person's right corner over the upper lip
INNER = (*INNER_LIP_UPPER, *reversed(INNER_LIP_LOWER[1:-1]))
N_INSTANTS = 5  # of a phone that are drawn


@dataclass(frozen=True, slots=True, eq=False)
class LipOutline:
    """Closed outlines (20, 2) of the lips at one instant, seen from the front: mm to the right and down."""

    outer: NDArray[np.float32]
    inner: NDArray[np.float32]


def lip_outlines(landmarks: NDArray[np.floating], rest: NDArray[np.floating]) -> tuple[LipOutline, ...]:
    """Outlines of landmarks (T, 478, 3) of one face, mm.

    The middle is that of the mouth's corners in `rest` (478, 3), so that outlines of several instants can be compared.
    """
    flip = np.array([1.0, -1.0])  # y is up in landmarks
    points, still = landmarks[..., :2] * flip, rest[:, :2] * flip
    middle = (still[OUTER[0]] + still[OUTER[len(OUTER_LIP_UPPER) - 1]]) / 2
    return tuple(
        LipOutline((face[list(OUTER)] - middle).astype(np.float32), (face[list(INNER)] - middle).astype(np.float32))
        for face in points
    )


def token_outlines(talker: Talker, token: UsedToken, n_instants: int = N_INSTANTS) -> tuple[LipOutline, ...]:
    """Outlines at equally spaced instants of a recorded token, from its beginning to its end, around its mean mouth.

    Raises
    ------
    InputError
        The talker has no such utterance.
    """
    utterance = next((one for one in talker.utterances if one.name == token.utterance), None)
    if utterance is None:
        raise InputError(f"the talker has no recording {token.utterance!r}; build the explanation with the same talker")
    times = np.linspace(token.start, token.end, n_instants)
    frames = np.arange(len(utterance.shape)) / talker.fps
    shape = interpolate_columns(utterance.shape, frames, np.clip(times, 0.0, frames[-1]))
    return lip_outlines(talker.model.shapes(shape), talker.model.mean)


SPEECH_MARGIN_S = 0.1  # compared from this long before the first phone to this long after the last
DTW_BAND_S = 0.12  # half width of the warping band: lead or lag of synthesis without cost
TIME_TOLERANCE_S = 1e-6  # a frame on an edge counts, in spite of rounding

Values = NDArray[np.floating]


def speech_frames(phones: PhoneSequence, n_frames: int, fps: float) -> slice:
    """Frames from `SPEECH_MARGIN_S` before the first sounding phone to as much behind the last.

    Raises
    ------
    InputError
        All phones are silence.
    """
    sounding = [at for at, label in enumerate(phones.phones) if label != SILENCE]
    if not sounding:
        raise InputError("an utterance without speech cannot be evaluated; remove it")
    start = phones.edges[sounding[0]] - SPEECH_MARGIN_S - TIME_TOLERANCE_S
    end = phones.edges[sounding[-1] + 1] + SPEECH_MARGIN_S + TIME_TOLERANCE_S
    times = np.arange(n_frames) / fps
    return slice(int(np.searchsorted(times, start)), int(np.searchsorted(times, end, side="right")))


def pearson(one: Values, other: Values) -> float:
    """Pearson's r of two series (T,); NaN where one of them is constant."""
    a, b = one - one.mean(dtype=np.float64), other - other.mean(dtype=np.float64)
    norm = float(np.sqrt((a @ a) * (b @ b)))
    return float(a @ b) / norm if norm > 1e-9 * len(a) else float("nan")


def correlation(real: Values, synthesised: Values) -> float:
    """Pearson's r of two series (T,); 0 where one of them is constant."""
    return float(np.nan_to_num(pearson(real, synthesised)))


def range_ratio(real: Values, synthesised: Values) -> float:
    """Standard deviation of the synthesised series over that of the real one; 1 is equal articulation."""
    return float(synthesised.std(dtype=np.float64) / real.std(dtype=np.float64))


def warping_cost(real: Values, synthesised: Values, spread: Values, band: int | None) -> float:
    """Mean distance of motions (T, D) and (U, D) in units of `spread` (D,), along the cheapest warp within a band."""
    cost = frame_distances(real / spread, synthesised / spread)
    path = warp_path(cost, band=band)
    return path_cost(cost, path) / len(path)
