"""Splits into training and held-out utterances."""

from collections.abc import Collection, Sequence

import numpy as np

from corpus_tools.measures.fingerprints import (
    check_no_same,
    fingerprint_observations,
    fingerprint_talker,
    same_name_warnings,
)
from corpus_tools.recordings.observation import Observation
from lexicon.errors import InputError
from tts2face.models.talker import Talker

PARTS = "the training and the held-out part"
HELD_OUT_ONE_IN, MAX_HELD_OUT = 5, 100  # held out by default: a fifth, enough for intervals of .02 of r at 100
Split = tuple[tuple[Observation, ...], tuple[Observation, ...]]  # training, held out


def split_randomly(observations: Sequence[Observation], *, hold_out: int | None = None, seed: int) -> Split:
    """Training and held-out utterances, drawn by a seed from the sorted names.

    Parameters
    ----------
    hold_out
        Number of held-out utterances; None: a fifth, at least 1 and at most `MAX_HELD_OUT`.

    Raises
    ------
    InputError
        `hold_out` is below 1 or not below the number of utterances.
    """
    if hold_out is None:
        hold_out = min(MAX_HELD_OUT, max(1, len(observations) // HELD_OUT_ONE_IN))
    if not 0 < hold_out < len(observations):
        raise InputError(
            f"of {len(observations)} utterances, 1 to {len(observations) - 1} can be held out, not {hold_out}"
        )
    ordered = _sort_by_name(observations)
    held = set(np.random.default_rng(seed).permutation(len(ordered))[:hold_out].tolist())
    return _split_at(ordered, held)


def split_into_folds(observations: Sequence[Observation], *, n_folds: int, seed: int) -> tuple[Split, ...]:
    """As many splits as folds; every utterance is held out once.

    Raises
    ------
    InputError
        There are fewer than two folds, or more than utterances.
    """
    if not 2 <= n_folds <= len(observations):
        raise InputError(f"{len(observations)} utterances make 2 to {len(observations)} folds, not {n_folds}")
    ordered = _sort_by_name(observations)
    order = np.random.default_rng(seed).permutation(len(ordered))
    return tuple(_split_at(ordered, set(held.tolist())) for held in np.array_split(order, n_folds))


def split_by_words(observations: Sequence[Observation], words: Collection[str]) -> Split:
    """Utterances without any of the words for training, and those with one held out: its contexts are unseen.

    Raises
    ------
    InputError
        A word does not occur, or every utterance contains one of them.
    """
    wanted = {word.lower() for word in words}
    spoken = {word.text.lower() for observation in observations for word in observation.words}
    if missing := sorted(wanted - spoken):
        raise InputError(f"no utterance contains {', '.join(missing)}; choose from: {', '.join(sorted(spoken)[:60])}")
    ordered = _sort_by_name(observations)
    held = {at for at, observation in enumerate(ordered) if wanted & {word.text.lower() for word in observation.words}}
    if len(held) == len(ordered):
        raise InputError(f"every utterance contains one of {', '.join(sorted(wanted))}; hold out fewer words")
    return _split_at(ordered, held)


def check_disjoint(splits: Sequence[Split]) -> tuple[str, ...]:
    """Warnings about equal names in both parts of a split, once it is checked that no recording is in both.

    A recording is found re-encoded or under another name (`measures.fingerprints`).

    Raises
    ------
    InputError
        There is such a recording, or one of the parts is empty.
    """
    for train, test in splits:
        if not test:
            raise InputError("there is no utterance to test")
        if not train:
            raise InputError("there is no utterance to learn from")
    every = {id(observation): observation for split in splits for part in split for observation in part}
    prints = dict(zip(every, fingerprint_observations(tuple(every.values())), strict=True))
    for train, test in splits:
        known, tested = ([prints[id(observation)] for observation in part] for part in (train, test))
        check_no_same(known, tested, PARTS, "remove it from one")
    names = (
        ([observation.name for observation in train], [observation.name for observation in test])
        for train, test in splits
    )
    found = (warning for known, tested in names for warning in same_name_warnings(known, tested, PARTS))
    return tuple(dict.fromkeys(found))


def check_unknown(talker: Talker, observations: Sequence[Observation]) -> tuple[str, ...]:
    """Warnings about names that a talker's recordings share, once it is checked that it was not learnt from these.

    Raises
    ------
    InputError
        A recording is in the talker, re-encoded or under another name.
    """
    places = f"the talker {talker.metadata.get('name', '')} and the recordings"
    known = fingerprint_talker(talker)
    check_no_same(known, fingerprint_observations(observations), places, "give other recordings, or another talker")
    return same_name_warnings(
        [recording.name for recording in known], [observation.name for observation in observations], places
    )


def _sort_by_name(observations: Sequence[Observation]) -> list[Observation]:
    # a seed gives one split, in whatever order recordings were read
    return sorted(observations, key=lambda observation: observation.name)


def _split_at(ordered: Sequence[Observation], held: Collection[int]) -> Split:
    train = tuple(item for at, item in enumerate(ordered) if at not in held)
    return train, tuple(item for at, item in enumerate(ordered) if at in held)
