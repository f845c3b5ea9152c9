"""Lip tracks of another speaker, aligned by models that start from a talker's recordings, as evidence for networks."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from corpus_tools.training.phone_codes import feature_table
from corpus_tools.training.pooling.lip_alignment import LipSpeech, align_phones, alignment_features, fit_part_model
from corpus_tools.training.pooling.lip_features import parameter_features
from corpus_tools.training.pooling.lip_tracks import LipTrack
from lexicon.phones import ARPABET
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.lips.motion_measures import speech_frames
from tts2face.models.talker import Talker
from tts2face.types import Progress, ignore_progress

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
    tracks: Sequence[LipTrack], talker: Talker, on_round: Progress = ignore_progress
) -> tuple[PooledSpeech, ...]:
    """Phones of the tracks in time, and their lip features z-scored over speech.

    Raises
    ------
    DataError
        The phones of a track do not fit into it.
    """
    known = _talker_speech(talker)
    labels = {phone.label for track in tracks for phone in track.phones}
    inventory = pooled_inventory(labels | {label for recording in known for label in recording.phones.phones})
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
        on_round(number + 1, N_ROUNDS)
    return tuple(_pooled(track, item.phones) for track, item in zip(tracks, aligned, strict=True))


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
    here = [speech_frames(utterance.phones, len(utterance.shape), talker.fps) for utterance in talker.utterances]
    speech = np.concatenate([values[span] for values, span in zip(features, here, strict=True)])
    mean, spread = speech.mean(axis=0), np.maximum(speech.std(axis=0), 1e-9)
    return [
        LipSpeech(alignment_features((values - mean) / spread, talker.fps), utterance.phones)
        for values, utterance in zip(features, talker.utterances, strict=True)
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
