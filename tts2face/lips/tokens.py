"""Phone tokens of a talker's recordings, with their positions in the recorded motion, which is read at any time."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lexicon.sequence import SILENCE
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import Float32Array
from tts2face.numeric.kernels import kernel

MAX_CONTEXT = 6  # stored context phones on either side
PAUSE_REACH_S = 0.25  # part of a silence that belongs to the adjacent speech, in which lips open or come to rest


@dataclass(frozen=True, slots=True, eq=False)
class Tokens:
    """N phone tokens over the recorded motion of all utterances.

    Parameters
    ----------
    inventory : P labels
        Sorted; `SILENCE` is always one of them.
    phone, utterance : (N,), (N,)
        Index into `inventory`, index of the talker's utterance.
    spans : (N, 4)
        Seconds on the utterance's clock: where the previous phone begins, this one begins, this one ends, the next one
        ends. Silence is limited to the `PAUSE_REACH_S` next to speech, as is the overlap with a neighbour.
    context : (N, 2 MAX_CONTEXT)
        Labels around the token: left at distance 1, right at 1, left at 2, ...; `SILENCE` beyond the utterance.
    frames, first_frame : (F, D), (U + 1,)
        Speech parameters of all frames, and where each utterance begins.
    fps
        Frames per second of the recordings.
    """

    inventory: tuple[str, ...]
    phone: NDArray[np.int32]
    utterance: NDArray[np.int32]
    spans: NDArray[np.float64]
    context: NDArray[np.int32]
    frames: NDArray[np.float32]
    first_frame: NDArray[np.int64]
    fps: float

    def __len__(self) -> int:
        """Count the tokens."""
        return len(self.phone)


def collect_tokens(talker: Talker) -> Tokens:
    """Tokens of all utterances of a talker, in the talker's order."""
    n_speech = talker.model.n_speech
    labels = [phone for utterance in talker.utterances for phone in utterance.phones.phones]
    inventory = tuple(sorted({*labels, SILENCE}))
    number = {label: at for at, label in enumerate(inventory)}
    phone = np.array([number[label] for label in labels], np.int32)
    counts = [len(utterance.phones) for utterance in talker.utterances]
    utterance = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
    lengths = [len(utterance.shape) for utterance in talker.utterances]
    return Tokens(
        inventory,
        phone,
        utterance,
        np.concatenate(
            [spoken_spans(utterance.phones.phones, utterance.phones.edges) for utterance in talker.utterances]
        ),
        phone_contexts(phone, utterance, number[SILENCE]),
        np.concatenate([utterance.shape[:, :n_speech] for utterance in talker.utterances]).astype(np.float32),
        np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
        talker.fps,
    )


def phone_contexts(phone: NDArray[np.int32], utterance: NDArray[np.int32], silence: int) -> NDArray[np.int32]:
    """(N, 2 `MAX_CONTEXT`) labels left and right of each of N phones, nearest first; `silence` beyond an utterance."""
    n = len(phone)
    around = np.full((n, 2 * MAX_CONTEXT), silence, np.int32)
    for distance in range(1, min(MAX_CONTEXT, n - 1) + 1):
        together = utterance[distance:] == utterance[:-distance]
        around[distance:, 2 * distance - 2][together] = phone[:-distance][together]
        around[:-distance, 2 * distance - 1][together] = phone[distance:][together]
    return around


def spoken_spans(phones: tuple[str, ...], edges: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 4) seconds at which the previous phone begins, each phone begins and ends, and the next one ends.

    A silence at either end of the utterance keeps only the `PAUSE_REACH_S` next to speech; the overlap with a
    neighbour has at most that length.
    """
    starts, ends = edges[:-1].copy(), edges[1:].copy()
    if len(phones) > 1:
        if phones[0] == SILENCE:
            # the rest of a long silence is no part of speech
            starts[0] = max(starts[0], ends[0] - PAUSE_REACH_S)
        if phones[-1] == SILENCE:
            ends[-1] = min(ends[-1], starts[-1] + PAUSE_REACH_S)
    return spans_with_reach(starts, ends)


def spans_with_reach(starts: NDArray[np.float64], ends: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 4): starts and ends, with the reach into the neighbours before and behind them."""
    before = np.concatenate([[starts[0] - PAUSE_REACH_S], starts[:-1]])
    behind = np.concatenate([ends[1:], [ends[-1] + PAUSE_REACH_S]])
    return np.stack(
        [np.maximum(before, starts - PAUSE_REACH_S), starts, ends, np.minimum(behind, ends + PAUSE_REACH_S)], axis=1
    )


@kernel
def read_motion(frames: Float32Array, first: int, last: int, at: float, out: Float32Array) -> None:
    """Write into `out` (D,) the value of rows [first, last) at frame position `at`, counted from `first`.

    Catmull-Rom cubic through the frames (Catmull and Rom 1974): it passes through each of them and, unlike linear
    interpolation, preserves extrema between frames. Constant beyond the ends.
    """
    n = last - first
    at = min(max(at, 0.0), n - 1.0)
    i = min(int(at), max(n - 2, 0))
    u = at - i
    a, b = first + max(i - 1, 0), first + i
    c, d = first + min(i + 1, n - 1), first + min(i + 2, n - 1)
    wa = u * (-0.5 + u * (1.0 - 0.5 * u))
    # Catmull-Rom weights of the rows before, at and behind the position
    wb = 1.0 + u * u * (-2.5 + 1.5 * u)
    wc = u * (0.5 + u * (2.0 - 1.5 * u))
    wd = u * u * (-0.5 + 0.5 * u)
    for k in range(frames.shape[1]):
        out[k] = wa * frames[a, k] + wb * frames[b, k] + wc * frames[c, k] + wd * frames[d, k]


@kernel
def sample_tokens(
    frames: Float32Array, bounds: NDArray[np.int64], positions: NDArray[np.float64], out: Float32Array
) -> None:
    """Write the recorded motion of N tokens at S frame positions each.

    Parameters
    ----------
    frames : (F, D)
    bounds : (N, 2)
        First row of the token's utterance and the row behind its last.
    positions : (N, S)
        Frames from the utterance's first.
    out : (N, S, D)
    """
    for n in range(positions.shape[0]):
        for s in range(positions.shape[1]):
            read_motion(frames, bounds[n, 0], bounds[n, 1], positions[n, s], out[n, s])
