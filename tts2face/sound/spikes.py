"""When the phones of known words are heard, and whether they are, by connectionist temporal classification.

A recogniser trained by connectionist temporal classification (Graves et al. 2006) says each phone in a frame or two
near its middle, and nothing between. Of all ways to say the words in the frames of a recording, forward and backward
sums give the probability with which each phone begins in each frame. A way may leave out a word that is not said, and
step over sounds that are not written, each at a cost.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray
from tts2face.numeric.kernels import kernel

# Log probabilities, chosen on voices in noise with right, wrong and incomplete transcripts.
LEAST = -12.0  # of a phone in a frame
IMPOSSIBLE = -50.0  # of a phone in silence, which is not heard
UNWRITTEN = -4.0  # of a frame between words in which something else is heard
UNSAID = -8.0  # of a word that is left out
NEVER = -np.inf
Pronounced = Sequence[Sequence[Sequence[int]]]  # columns of the phones of all pronunciations of each word


def find_spikes(log_probabilities: NDArray[np.float32], words: Pronounced, unsaid: float) -> FloatArray:
    """Probabilities (T, N) with which each phone begins in each frame, in the order of words, pronunciations, phones.

    Their sum over the frames is the probability that the phone is said.

    Parameters
    ----------
    log_probabilities : (T, P + 1)
        Of phones, and of none, in each frame.
    unsaid
        Log probability of a word that is left out.
    """
    states = _States(words, unsaid, log_probabilities.shape[1] - 1)
    stated = log_probabilities.astype(np.float64)
    # Phones of minutes of silence, each as probable as the least one, would outweigh a phone that is hardly heard.
    emitted = np.where(stated > IMPOSSIBLE, np.maximum(stated, LEAST), stated)[:, states.columns]
    between = states.between
    emitted[:, between] = np.maximum(emitted[:, between], UNWRITTEN)
    arcs = np.cumsum([0, *map(len, states.before)]), np.concatenate(states.before), np.concatenate(states.costs)
    entered = np.zeros(emitted.shape)
    _entry_probabilities(emitted, arcs, np.array(states.ends), entered)
    return entered[:, states.phones]


class _States:
    """States of a recogniser that says words: one for each phone, and one around each of them that says nothing."""

    def __init__(self, words: Pronounced, unsaid: float, blank: int) -> None:
        self.columns: list[int] = []
        self.before: list[NDArray[np.int64]] = []  # the states before each one, and the log probabilities of the steps
        self.costs: list[FloatArray] = []
        self.phones: list[int] = []  # numbers of the states
        self.between: list[int] = [self._add(blank, [])]
        self.ends = self.between[:]
        for pronunciations in words:
            last = []
            for phones in pronunciations:
                reached = self.ends
                for at, column in enumerate(phones):
                    # between two equal phones the network is silent, else they would be one (CTC)
                    phone = self._add(column, [state for state in reached if self.columns[state] != column])
                    self.phones.append(phone)
                    if at + 1 < len(phones):
                        reached = [phone, self._add(blank, [phone])]
                last.append(phone)
            silence = self._add(blank, [*last, self.between[-1]])
            self.costs[silence][-1] = unsaid
            self.between.append(silence)
            self.ends = [*last, silence]

    def _add(self, column: int, before: list[int]) -> int:
        self.columns.append(column)
        self.before.append(np.array(before, np.int64))
        self.costs.append(np.zeros(len(before)))
        return len(self.columns) - 1


@kernel
def _entry_probabilities(emitted, arcs, ends, entered):  # type: ignore[no-untyped-def]
    """Write the probabilities (T, S) that states are entered in each frame, by sums forward and backward in time."""
    n_frames, n_states = emitted.shape
    inside = np.full(n_states, -np.inf)
    reached = np.full(n_states, -np.inf)
    reached[0] = 0.0
    _add_forward(arcs, reached.copy(), reached)
    for t in range(n_frames):
        if t > 0:
            reached = np.full(n_states, -np.inf)
            _add_forward(arcs, inside, reached)
        entered[t] = reached + emitted[t]
        for s in range(n_states):
            inside[s] = _log_sum(inside[s], reached[s]) + emitted[t, s]
    whole = -np.inf
    for end in ends:
        whole = _log_sum(whole, inside[end])
    behind = np.full(n_states, -np.inf)
    behind[ends] = 0.0
    for t in range(n_frames - 1, -1, -1):
        if t < n_frames - 1:
            left = behind + emitted[t + 1]
            behind = left.copy()
            _add_backward(arcs, left, behind)
        entered[t] = np.exp(np.minimum(entered[t] + behind - whole, 0.0))


@kernel
def _add_forward(arcs, left, reached):  # type: ignore[no-untyped-def]
    """Add to the log probabilities (S,) of states those of the steps from the states that are left."""
    firsts, before, costs = arcs
    for s in range(len(reached)):
        for at in range(firsts[s], firsts[s + 1]):
            reached[s] = _log_sum(reached[s], left[before[at]] + costs[at])


@kernel
def _add_backward(arcs, reached, left):  # type: ignore[no-untyped-def]
    """Add to the log probabilities (S,) of states those of the steps to the states that are reached."""
    firsts, before, costs = arcs
    for s in range(len(reached)):
        for at in range(firsts[s], firsts[s + 1]):
            left[before[at]] = _log_sum(left[before[at]], reached[s] + costs[at])


@kernel
def _log_sum(a, b):  # type: ignore[no-untyped-def]
    """Logarithm of the sum of two numbers given by their logarithms."""
    if a < b:
        a, b = b, a
    return a if b == -np.inf else a + np.log1p(np.exp(b - a))
