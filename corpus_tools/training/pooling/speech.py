"""Lip tracks of another speaker, aligned by models that start from a talker's recordings, as evidence for networks.

English phrases as the networks of a base talker articulate them: evidence of phones that a talker's recordings lack.

The phrases are drawn from CMUdict and from frequent function words, always the same ones, so that the file of the base
suffices: no recordings of the base's speakers are needed (docs/decisions/131-base.md).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.network_training import feature_table
from corpus_tools.training.pooling.lip_alignment import LipSpeech, align_phones, alignment_features, fit_part_model
from corpus_tools.training.pooling.lip_tracks import LipTrack, parameter_features
from lexicon.dictionary import cmudict_words, word_set
from lexicon.errors import InputError
from lexicon.nominal_durations import nominal_phones
from lexicon.phones import ARPABET
from lexicon.pronounce import pronounce
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.motion_measures import speech_frames
from tts2face.lips.targets import build_targets, target_phones
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.talker import Talker
from tts2face.types import Progress, frame_count

N_ROUNDS = 4  # alignments: the first by the talker's model, the others by models of both speakers
SILENCE_KEPT_S = 0.2  # of silence around speech in the evidence


@dataclass(frozen=True, slots=True, eq=False)
class PooledSpeech:
    """One recording of another speaker: z-scored lip features (T, 8), phones in time, and the frames (T,) in use."""

    name: str
    fps: float
    features: NDArray[np.float64]
    phones: PhoneSequence
    is_used: NDArray[np.bool_]


def align_lip_tracks(
    tracks: Sequence[LipTrack], talker: Talker, on_round: Callable[[int, int], None] | None = None
) -> tuple[PooledSpeech, ...]:
    """Phones of the tracks in time, and their lip features z-scored over speech.

    Raises
    ------
    DataError
        The phones of a track do not fit into it.
    """
    known = _talker_speech(talker)
    labels = {phone.label for track in tracks for phone in track.phones}
    inventory = pooled_inventory(labels | {label for one in known for label in one.phones.phones})
    table = feature_table(inventory)
    seen = [alignment_features(_z_score(track.features), track.fps) for track in tracks]
    expected = [np.array([phone.end for phone in track.phones]) for track in tracks]
    aligned: list[LipSpeech] = []
    for number in range(N_ROUNDS):
        model = fit_part_model(known, aligned, inventory, table)
        aligned = []
        for at, track in enumerate(tracks):
            names = [phone.label for phone in track.phones]
            optional = np.array([phone.is_optional for phone in track.phones])
            speaker = min(number, 1)
            expected[at], _ = align_phones(seen[at], names, optional, expected[at], model, speaker=speaker)
            aligned.append(LipSpeech(seen[at], spoken_sequence(names, expected[at])))
        if on_round:
            on_round(number + 1, N_ROUNDS)
    return tuple(_pooled(track, one.phones) for track, one in zip(tracks, aligned, strict=True))


def pooled_inventory(labels: set[str]) -> tuple[str, ...]:
    """Sorted phones of networks for free English: those given, every phone with an ARPABET name, and silence."""
    return tuple(sorted({*labels, *ARPABET.values(), SILENCE}))


def spoken_sequence(labels: Sequence[str], ends: NDArray[np.float64]) -> PhoneSequence:
    """Phones in time, without those of no duration; the first begins at 0 s."""
    starts = np.concatenate([[0.0], ends[:-1]])
    kept = [at for at in range(len(labels)) if ends[at] > starts[at]]
    return PhoneSequence([labels[at] for at in kept], np.concatenate([[0.0], ends[kept]]))


def _talker_speech(talker: Talker) -> list[LipSpeech]:
    features = [talker_features(talker, at) for at in range(len(talker.utterances))]
    here = [speech_frames(one.phones, len(one.shape), talker.fps) for one in talker.utterances]
    speech = np.concatenate([values[span] for values, span in zip(features, here, strict=True)])
    mean, spread = speech.mean(axis=0), np.maximum(speech.std(axis=0), 1e-9)
    return [
        LipSpeech(alignment_features((values - mean) / spread, talker.fps), one.phones)
        for values, one in zip(features, talker.utterances, strict=True)
    ]


def talker_features(talker: Talker, at: int) -> NDArray[np.float64]:
    """(T, 8) lip features of a talker's utterance."""
    model = talker.model
    return parameter_features(talker.utterances[at].shape[:, : model.n_speech], model)


def _z_score(values: NDArray[np.float64]) -> NDArray[np.float64]:
    scored: NDArray[np.float64] = (values - values.mean(axis=0)) / np.maximum(values.std(axis=0), 1e-9)
    return scored


def _pooled(track: LipTrack, phones: PhoneSequence) -> PooledSpeech:
    times = np.arange(len(track.features)) / track.fps
    at = np.clip(np.searchsorted(phones.edges, times, side="right") - 1, 0, len(phones) - 1)
    silent = np.array([label == SILENCE for label in phones.phones])[at]
    to_speech = np.minimum(times - phones.edges[at], phones.edges[at + 1] - times)
    is_used = (~silent | (to_speech < SILENCE_KEPT_S)) & (times < phones.end)
    mean, spread = track.features[is_used].mean(axis=0), track.features[is_used].std(axis=0)
    return PooledSpeech(track.name, track.fps, (track.features - mean) / np.maximum(spread, 1e-9), phones, is_used)


N_PHRASES = 500  # about half an hour of speech: as much as the lip tracks of decision 124
WORDS_IN_PHRASE = 7
WORD_LETTERS = range(2, 11)  # of words from CMUdict
FUNCTION_SHARE = 0.4  # of the words; about half of running English are function words
FUNCTION_WORDS = tuple(sorted(word_set(
    "a about after all an and are as at be been but by can could do down for from had has have he her him his how i if "
    "in into is it its just me more my no not now of off on one or our out over she should so some than that the their "
    "them then there these they this through to up us was we were what when where which while who will with would you "
    "your"
)))  # fmt: skip
TEMPI = (0.75, 1.25)  # factors of nominal durations, one for each phrase
DURATION_SPREAD = 0.25  # standard deviation of the logarithm of single durations
EDGE_SILENCE_S = 0.3
FPS = 25.0

Floats = NDArray[np.float64]


def base_speech(base: Talker, *, on_progress: Progress | None = None) -> tuple[PooledSpeech, ...]:
    """Lip features of `N_PHRASES` phrases by the networks of a base talker, z-scored over all of them.

    Raises
    ------
    InputError
        The base has no networks.
    """
    if base.network is None:
        raise InputError(f"talker {base.metadata.get('name')} has no phone networks; name another base, or --base none")
    phrases = english_phrases(N_PHRASES)
    seen, used = [], []
    for done, phones in enumerate(phrases, start=1):
        times = np.arange(frame_count(phones.end, FPS)) / FPS
        first, last = phones.edges[1] - SILENCE_KEPT_S, phones.edges[-2] + SILENCE_KEPT_S
        used.append((times >= first) & (times <= last))
        seen.append(_network_features(base, base.network, phones, times))
        if on_progress:
            on_progress(done, len(phrases))
    speech = np.concatenate([values[here] for values, here in zip(seen, used, strict=True)])
    mean, spread = speech.mean(axis=0), np.maximum(speech.std(axis=0), 1e-9)
    return tuple(
        PooledSpeech(f"phrase {at}", FPS, (values - mean) / spread, phones, here)
        for at, (values, phones, here) in enumerate(zip(seen, phrases, used, strict=True), start=1)
    )


def english_phrases(n_phrases: int) -> tuple[PhoneSequence, ...]:
    """Phones of the first phrases of a fixed series of random words, with silence around; nominal durations, varied."""
    stream = np.random.default_rng(0)
    words = [word for word in cmudict_words() if word.isalpha() and len(word) in WORD_LETTERS]
    phrases = []
    for _ in range(n_phrases):
        chosen = []
        for _ in range(WORDS_IN_PHRASE):
            source = FUNCTION_WORDS if stream.random() < FUNCTION_SHARE else words
            chosen.append(source[int(stream.integers(len(source)))])
        nominal, _ = nominal_phones(pronounce(" ".join(chosen)))
        durations = nominal.durations * stream.uniform(*TEMPI)
        durations *= np.exp(stream.normal(0.0, DURATION_SPREAD, len(durations)))
        durations[[0, -1]] = EDGE_SILENCE_S
        edges = np.round(np.cumsum(durations), 6)  # exp differs in its last bit between processors
        phrases.append(PhoneSequence(nominal.phones, np.concatenate([[0.0], edges])))
    return tuple(phrases)


def _network_features(base: Talker, network: PhoneNetwork, phones: PhoneSequence, times: Floats) -> Floats:
    shown = target_phones(build_targets(phones, network.inventory))
    return parameter_features(network.parameters(shown, times), base.model)
