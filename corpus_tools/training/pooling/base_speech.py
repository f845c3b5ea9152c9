"""English phrases as a base talker's networks articulate them: evidence of phones that a talker's recordings lack.

The phrases are drawn from CMUdict and from frequent function words, always the same ones, so that the file of the base
suffices: no recordings of the base's speakers are needed (docs/decisions/131-base.md).
"""

import numpy as np

from corpus_tools.training.pooling.lip_features import parameter_features
from corpus_tools.training.pooling.speech import SILENCE_KEPT_S, PooledSpeech
from lexicon.dictionary import cmudict_words, word_set
from lexicon.errors import InputError
from lexicon.nominal_durations import nominal_phones
from lexicon.pronounce import pronounce
from lexicon.sequence import PhoneSequence
from tts2face.lips.targets import build_targets, target_phones
from tts2face.models.phone_network import PhoneNetwork
from tts2face.models.talker import Talker
from tts2face.numeric.arrays import FloatArray
from tts2face.types import Progress, frame_count, ignore_progress

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


def base_speech(base: Talker, *, on_progress: Progress = ignore_progress) -> tuple[PooledSpeech, ...]:
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


def _network_features(base: Talker, network: PhoneNetwork, phones: PhoneSequence, times: FloatArray) -> FloatArray:
    shown = target_phones(build_targets(phones, network.inventory))
    return parameter_features(network.parameters(shown, times), base.model)
