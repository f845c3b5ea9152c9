"""Search for the recorded tokens in the most similar phone contexts (T07 section 3.3)."""

from dataclasses import dataclass
from functools import cached_property

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


@dataclass(frozen=True, slots=True, eq=False)
class TokenQuery:
    """N query phones: labels (N,), contexts (N, 2 `MAX_CONTEXT`) and log durations (N, 3).

    Columns of `log_durations`: the previous phone, the phone itself, the next phone; neighbours up to their reach.
    """

    phone: NDArray[np.int32]
    context: NDArray[np.int32]
    log_durations: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class ContextIndex:
    """Tokens sorted into groups with the same phone and the same `N_GROUP_CONTEXT` neighbours either side.

    The tokens ``order[group_first[g]:group_first[g + 1]]`` form group g, the shortest first; the groups
    ``phone_first[p]:phone_first[p + 1]`` belong to phone p.
    """

    order: NDArray[np.int32]
    group_first: NDArray[np.int32]
    phone_first: NDArray[np.int32]
    context: NDArray[np.int32]
    log_durations: NDArray[np.float64]
    similarity: NDArray[np.float64]

    @cached_property
    def far_likeness(self) -> NDArray[np.float64]:
        """(G, F, P) highest similarity of each label to what any token of a group has in each far context column.

        Together with the neighbours that a group shares and the difference of durations it bounds the scores of a group
        from above.
        """
        columns = self.context[self.order, 2 * N_GROUP_CONTEXT :].T
        firsts = self.group_first[:-1]
        return np.stack([np.maximum.reduceat(self.similarity[column], firsts, axis=0) for column in columns], axis=1)


@dataclass(frozen=True, slots=True, eq=False)
class TokenRanking:
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
    return ContextIndex(
        order,
        np.concatenate([firsts, [len(order)]]).astype(np.int32),
        np.searchsorted(keys[firsts, 0], np.arange(len(tokens.inventory) + 1)).astype(np.int32),
        tokens.context,
        durations,
        similarity,
    )


def context_weights(n_context: int) -> NDArray[np.float64]:
    """(C,) weights 1 / (d + 1) of the phones at distance d = 1..C."""
    return np.asarray(1.0 / (np.arange(1, n_context + 1) + 1.0))


def best_tokens(query: TokenQuery, index: ContextIndex, *, context: int, k: int, duration: float) -> TokenRanking:
    """The k tokens of each query phone with the most similar contexts.

    Score = sum over d = 1..context of [S(left_d, its left_d) + S(right_d, its right_d)] / (d + 1), less, where
    `duration` is above 0, ``duration`` x (|log ratio of durations| + half of the neighbours' ones). Equal scores go to
    the token that comes first in the corpus.

    Raises
    ------
    InputError
        `context` is not 1 to `MAX_CONTEXT`, `k` is not 1 to `MAX_EXEMPLARS`, or `duration` below 0.

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
    _search_groups(
        (query.phone, query.context, query.log_durations),
        (index.order, index.group_first, index.phone_first, index.context, index.log_durations),
        index.far_likeness if context > N_GROUP_CONTEXT else NO_LIKENESS,
        (index.similarity, context_weights(context), duration),
        (tokens, scores),
        np.zeros(int(np.diff(index.phone_first).max(initial=0))),
    )
    return TokenRanking(tokens, scores)


@kernel
def _score(target, target_durations, token, token_durations, rule):  # type: ignore[no-untyped-def]
    similarity, weights, duration = rule
    total = 0.0
    for d in range(len(weights)):
        left, right = 2 * d, 2 * d + 1
        total += weights[d] * (similarity[target[left], token[left]] + similarity[target[right], token[right]])
    if duration > 0.0:
        before, own, behind = target_durations[0], target_durations[1], target_durations[2]
        neighbours = abs(before - token_durations[0]) + abs(behind - token_durations[2])
        total -= duration * (abs(own - token_durations[1]) + 0.5 * neighbours)
    return total


@kernel
def _insert_token(tokens, scores, token, score):  # type: ignore[no-untyped-def]
    """Put a token into the ranking if it belongs there: higher score first, then lower token."""
    k = len(tokens)
    if score < scores[k - 1] or (score == scores[k - 1] and token > tokens[k - 1] >= 0):
        return
    at = k - 1
    while at > 0 and (scores[at - 1] < score or (scores[at - 1] == score and tokens[at - 1] > token)):
        scores[at], tokens[at] = scores[at - 1], tokens[at - 1]
        at -= 1
    scores[at], tokens[at] = score, token


@kernel
def _score_bound(target, token, group, rule):  # type: ignore[no-untyped-def]
    """Score that no token of a group exceeds; `token`: context of one of its tokens, all of whose neighbours agree."""
    similarity, weights, _ = rule
    far_likeness, g = group
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
def _search_groups(query, index, far_likeness, rule, found, space):  # type: ignore[no-untyped-def]
    """Write the rankings; `space` has a place for each group of a phone."""
    phone, contexts, durations = query
    order, group_first, phone_first, token_contexts, token_durations = index
    tokens, scores = found
    for n in range(len(phone)):
        first, last = phone_first[phone[n]], phone_first[phone[n] + 1]
        bounds = space[: last - first]
        for g in range(first, last):
            shared = token_contexts[order[group_first[g]]]
            bounds[g - first] = _score_bound(contexts[n], shared, (far_likeness, g), rule)
        for _ in range(last - first):
            g = _argmax(bounds)
            bound = bounds[g]
            if bound < scores[n, -1]:
                break
            bounds[g] = -np.inf
            low, high = group_first[first + g], group_first[first + g + 1]
            target = (contexts[n], durations[n], bound)
            _search_group(target, order[low:high], (token_contexts, token_durations), rule, (tokens[n], scores[n]))


@kernel
def _search_group(target, group, corpus, rule, found):  # type: ignore[no-untyped-def]
    """Score the tokens of a group outwards from the query's duration while they can enter the ranking."""
    context, durations, bound = target
    token_contexts, token_durations = corpus
    tokens, scores = found
    low, high = 0, len(group)
    while low < high:  # the first token that is not shorter than the query
        middle = (low + high) // 2
        if token_durations[group[middle], 1] < durations[1]:
            low = middle + 1
        else:
            high = middle
    for step in (-1, 1):
        at = low - 1 if step < 0 else low
        while 0 <= at < len(group):
            token = group[at]
            if bound - rule[2] * abs(token_durations[token, 1] - durations[1]) < scores[-1]:
                break
            score = _score(context, durations, token_contexts[token], token_durations[token], rule)
            _insert_token(tokens, scores, token, score)
            at += step


@kernel
def _argmax(values):  # type: ignore[no-untyped-def]
    """Index of the first highest value; `numpy.argmax` takes seconds to compile."""
    at = 0
    for i in range(1, len(values)):
        if values[i] > values[at]:
            at = i
    return at
