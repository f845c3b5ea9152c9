"""Search for the recorded tokens in the most similar phone contexts (T07 section 3.3)."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import InputError
from lexicon.values.checks import format_value
from tts2face.lips.tokens import MAX_CONTEXT, Tokens
from tts2face.numeric.kernels import kernel

MAX_EXEMPLARS = 10_000  # of a phone; an hour of recordings has half as many of the most frequent one
N_GROUP_CONTEXT = 3  # neighbours either side that are alike in a group; the default context
NO_LIKENESS = np.zeros((0, 0, 0))
_ROUNDING = 1e-9  # a bound may fall below the score it bounds by rounding; scores are of order 1


class TokenQuery(NamedTuple):
    """N query phones: labels (N,), contexts (N, 2 `MAX_CONTEXT`) and log durations (N, 3).

    Columns of `log_durations`: the previous phone, the phone itself, the next phone; neighbours up to their reach.
    """

    phone: NDArray[np.int32]
    context: NDArray[np.int32]
    log_durations: NDArray[np.float64]


class GroupedTokens(NamedTuple):
    """Tokens sorted into groups with the same phone and the same `N_GROUP_CONTEXT` neighbours either side.

    The tokens ``order[group_first[g]:group_first[g + 1]]`` form group g, the shortest first; the groups
    ``phone_first[p]:phone_first[p + 1]`` belong to phone p.
    """

    order: NDArray[np.int32]
    group_first: NDArray[np.int32]
    phone_first: NDArray[np.int32]
    context: NDArray[np.int32]
    log_durations: NDArray[np.float64]


class Scoring(NamedTuple):
    """Similarity of phones (P, P), weights of their distances, and weight of durations."""

    similarity: NDArray[np.float64]
    weights: NDArray[np.float64]
    duration: float


class Target(NamedTuple):
    """One query phone, and the score that no token of a group exceeds."""

    context: NDArray[np.int32]
    log_durations: NDArray[np.float64]
    bound: float


@dataclass(frozen=True, eq=False)
class ContextIndex:
    """A talker's tokens in groups, with the similarity of their phones."""

    tokens: GroupedTokens
    similarity: NDArray[np.float64]

    @cached_property
    def far_likeness(self) -> NDArray[np.float64]:
        """(G, F, P) highest similarity of each label to what any token of a group has in each far context column.

        Together with the neighbours that a group shares and the difference of durations it bounds the scores of a group
        from above.
        """
        columns = self.tokens.context[self.tokens.order, 2 * N_GROUP_CONTEXT :].T
        firsts = self.tokens.group_first[:-1]
        return np.stack([np.maximum.reduceat(self.similarity[column], firsts, axis=0) for column in columns], axis=1)


class TokenRanking(NamedTuple):
    """Best tokens of N phones: `tokens` and `scores` (N, k), best first; -1 and -inf where there are fewer."""

    tokens: NDArray[np.int32]
    scores: NDArray[np.float64]


def log_durations(spans: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, 3) logarithms of the durations before, in and behind a token, from its (N, 4) span; at least 10 ms."""
    return np.log(np.maximum(np.diff(spans, axis=1), 0.01))


def context_index(
    tokens: Tokens, similarity: NDArray[np.float64], is_kept: NDArray[np.bool_] | None = None
) -> ContextIndex:
    """Index of a talker's tokens, or of those that are kept (N,), for the (P, P) similarity of its phones."""
    near = tokens.context[:, : 2 * N_GROUP_CONTEXT]
    durations = log_durations(tokens.spans)
    order = np.lexsort((durations[:, 1], *near.T[::-1], tokens.phone)).astype(np.int32)
    if is_kept is not None:
        order = order[is_kept[order]]
    keys = np.column_stack([tokens.phone, near])[order]
    firsts = np.flatnonzero(np.concatenate([[True], (keys[1:] != keys[:-1]).any(1)]))
    grouped = GroupedTokens(
        order,
        np.concatenate([firsts, [len(order)]]).astype(np.int32),
        np.searchsorted(keys[firsts, 0], np.arange(len(tokens.inventory) + 1)).astype(np.int32),
        tokens.context,
        durations,
    )
    return ContextIndex(grouped, similarity)


def context_weights(n_context: int) -> NDArray[np.float64]:
    """(C,) weights 1 / (d + 1) of the phones at distance d = 1..C."""
    return np.asarray(1.0 / (np.arange(1, n_context + 1) + 1.0))


def best_tokens(query: TokenQuery, index: ContextIndex, *, context: int, k: int, duration: float) -> TokenRanking:
    """The k tokens of each query phone with the most similar contexts.

    Score = sum over d = 1..context of [S(left_d, its left_d) + S(right_d, its right_d)] / (d + 1), less, where
    `duration` is above 0, ``duration`` x (|log ratio of durations| + half of the neighbours' ones). Equal scores go to
    the token that comes first in the corpus.

    Notes
    -----
    The result equals that of an exhaustive search. Groups of tokens with the same neighbours are visited in descending
    order of the upper bound of their scores, until the bound falls below the k-th best score; within a group, tokens
    are visited by increasing difference from the query's duration.
    """
    if not 1 <= context <= MAX_CONTEXT:
        raise InputError(f"context must be 1 to {MAX_CONTEXT} phones, not {format_value(context)}")
    if not 1 <= k <= MAX_EXEMPLARS:
        raise InputError(f"the number of exemplars must be 1 to {MAX_EXEMPLARS}, not {format_value(k)}")
    if not duration >= 0:
        raise InputError(f"the weight of durations must be 0 or more, not {duration}")
    tokens = np.full((len(query.phone), k), -1, np.int32)
    scores = np.full((len(query.phone), k), -np.inf)
    found = TokenRanking(tokens, scores)
    _search_groups(
        query,
        index.tokens,
        index.far_likeness if context > N_GROUP_CONTEXT else NO_LIKENESS,
        Scoring(index.similarity, context_weights(context), duration),
        found,
        np.zeros(int(np.diff(index.tokens.phone_first).max(initial=0))),
    )
    return found


@kernel
def _score(target, context, durations, scoring):  # type: ignore[no-untyped-def]
    """Score of a token, by its context and log durations, for a query phone."""
    similarity, weights = scoring.similarity, scoring.weights
    total = 0.0
    for d in range(len(weights)):
        left, right = 2 * d, 2 * d + 1
        total += weights[d] * (
            similarity[target.context[left], context[left]] + similarity[target.context[right], context[right]]
        )
    if scoring.duration > 0.0:
        wanted = target.log_durations
        neighbours = abs(wanted[0] - durations[0]) + abs(wanted[2] - durations[2])
        total -= scoring.duration * (abs(wanted[1] - durations[1]) + 0.5 * neighbours)
    return total


@kernel
def _insert_token(tokens, scores, token, score):  # type: ignore[no-untyped-def]
    """Put a token into the ranking if it belongs there: higher score first, then lower token."""
    k = len(tokens)
    # of equal scores the lower number wins, so that the order of the search does not matter
    if score < scores[k - 1] or (score == scores[k - 1] and token > tokens[k - 1] >= 0):
        return
    at = k - 1
    while at > 0 and (scores[at - 1] < score or (scores[at - 1] == score and tokens[at - 1] > token)):
        scores[at], tokens[at] = scores[at - 1], tokens[at - 1]
        at -= 1
    scores[at], tokens[at] = score, token


@kernel
def _score_bound(target, token, far_likeness, g, scoring):  # type: ignore[no-untyped-def]
    """Score that no token of a group exceeds; `token`: context of one of its tokens, all of whose neighbours agree.

    `far_likeness` is that of all groups, of which this is the g-th.
    """
    similarity, weights = scoring.similarity, scoring.weights
    total = _ROUNDING
    for d in range(min(len(weights), N_GROUP_CONTEXT)):
        left, right = 2 * d, 2 * d + 1
        total += weights[d] * (similarity[token[left], target[left]] + similarity[token[right], target[right]])
    for d in range(N_GROUP_CONTEXT, len(weights)):
        left, right = 2 * d, 2 * d + 1
        far = 2 * (d - N_GROUP_CONTEXT)
        total += weights[d] * (far_likeness[g, far, target[left]] + far_likeness[g, far + 1, target[right]])
    return total


@kernel
def _search_groups(query, tokens, far_likeness, scoring, found, space):  # type: ignore[no-untyped-def]
    """Write the rankings; `space` has a place for each group of a phone."""
    order, group_first = tokens.order, tokens.group_first
    for n in range(len(query.phone)):
        first, last = tokens.phone_first[query.phone[n]], tokens.phone_first[query.phone[n] + 1]
        bounds = space[: last - first]
        for g in range(first, last):
            shared = tokens.context[order[group_first[g]]]
            bounds[g - first] = _score_bound(query.context[n], shared, far_likeness, g, scoring)
        for _ in range(last - first):
            g = _argmax(bounds)
            bound = bounds[g]
            # groups come by falling bounds: no later one can enter
            if bound < found.scores[n, -1]:
                break
            bounds[g] = -np.inf
            low, high = group_first[first + g], group_first[first + g + 1]
            target = Target(query.context[n], query.log_durations[n], bound)
            ranking = TokenRanking(found.tokens[n], found.scores[n])
            _search_group(target, order[low:high], tokens, scoring, ranking)


@kernel
def _search_group(target, group, tokens, scoring, found):  # type: ignore[no-untyped-def]
    """Score the tokens of a group outwards from the query's duration while they can enter the ranking."""
    context, durations = tokens.context, tokens.log_durations
    own = target.log_durations[1]
    low, high = 0, len(group)
    while low < high:  # the first token that is not shorter than the query
        middle = (low + high) // 2
        if durations[group[middle], 1] < own:
            low = middle + 1
        else:
            high = middle
    for step in (-1, 1):
        at = low - 1 if step < 0 else low
        while 0 <= at < len(group):
            token = group[at]
            if target.bound - scoring.duration * abs(durations[token, 1] - own) < found.scores[-1]:
                break
            score = _score(target, context[token], durations[token], scoring)
            _insert_token(found.tokens, found.scores, token, score)
            at += step


@kernel
def _argmax(values):  # type: ignore[no-untyped-def]
    """Index of the first highest value; `numpy.argmax` takes seconds to compile."""
    at = 0
    for i in range(1, len(values)):
        if values[i] > values[at]:
            at = i
    return at
