"""Training of the classifier of the voice's phones (`tts2face.models.phone_classifier`) on its own speech.

The voice speaks the shipped prompts, and words of CMUdict in random order, which hold every phone in many
neighbourhoods, at several rates. PocketSphinx aligns each part; one whose edges contradict what the voice states is
left out. The frames are learnt by scikit-learn's `MLPClassifier`.
"""

import warnings
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache

import numpy as np
from numpy.typing import NDArray

from corpus_tools.prompts.prompts import shipped_sentences
from lexicon.dictionary import cmudict_words
from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence
from tts2face.models.phone_classifier import PhoneClassifier
from tts2face.sound.alignment import Aligner
from tts2face.sound.heart import NeuralVoice
from tts2face.sound.segments import STEP_S, frame_features
from tts2face.types import Progress, Waveform

N_RANDOM = 800  # texts of words in random order
N_WORDS = (3, 9)
ENDS, COMMA_SHARE = (".", ".", "?", "!"), 0.15
RATES = (1.0, 1.0, 0.5, 0.7, 0.85, 1.2, 1.5, 2.0)
MOST_MISPLACED_S = 0.1  # of the begin of a word; beyond it, one of both is wrong
N_UNITS, N_EPOCHS = 128, 12
LEAST_SPREAD, WEIGHT_DECAY = 0.05, 1e-4
TEST_SHARE = 20  # every twentieth text tells the accuracy


def train_phone_classifier(*, on_progress: Progress, report: Callable[[str], None]) -> PhoneClassifier:
    """Classifier of the voice ``heart``; `report` is told its accuracy on texts that it has not learnt."""
    from sklearn.neural_network import MLPClassifier

    texts = training_texts()
    features, labels, is_test = [], [], []
    for at, text in enumerate(texts):
        for sound, phones in _aligned_parts(text, rate=RATES[at % len(RATES)], seed=at):
            seen = frame_features(sound)
            features.append(seen)
            labels.append(phone_labels(phones, len(seen)))
            is_test.append(np.full(len(seen), at % TEST_SHARE == 0))
        on_progress(at + 1, len(texts))
    seen, known, test = np.concatenate(features), np.concatenate(labels), np.concatenate(is_test)
    mean, scale = seen.mean(axis=0), 1.0 / np.maximum(seen.std(axis=0), LEAST_SPREAD)
    model = MLPClassifier(
        (N_UNITS,), batch_size=512, learning_rate_init=2e-3, max_iter=N_EPOCHS, alpha=WEIGHT_DECAY, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it has not converged after its epochs
        model.fit((seen[~test] - mean) * scale, known[~test])
    layers = [tuple(part.astype(np.float32) for part in layer) for layer in (model.coefs_, model.intercepts_)]
    classifier = PhoneClassifier(tuple(model.classes_.tolist()), mean, scale, *layers)
    found = np.array(classifier.inventory)[classifier.log_probabilities(seen[test]).argmax(axis=1)]
    report(f"{len(seen)} frames; of those of other texts {np.mean(found == known[test]):.1%} are told rightly")
    return classifier


def training_texts() -> tuple[str, ...]:
    """The prompts, and words in random order."""
    rng, words = np.random.default_rng(0), [word for word in cmudict_words() if word.isalpha()]
    made = []
    for _ in range(N_RANDOM):
        chosen = rng.choice(words, int(rng.integers(*N_WORDS)))
        spoken = [f"{word}," if rng.random() < COMMA_SHARE else word for word in chosen]
        made.append(" ".join(spoken).rstrip(",") + str(rng.choice(ENDS)))
    return (*shipped_sentences(), *made)


def _aligned_parts(text: str, *, rate: float, seed: int) -> Iterator[tuple[Waveform, PhoneSequence]]:
    """Sound and phones of each part of a text that is aligned as the voice states it."""
    voice, aligner = _speakers()
    for sound, words, stated in voice.parts(text, rate=rate, seed=seed):
        with suppress(DataError):
            found = aligner.align(sound, [(word.text, [word.phones]) for word in words])
            begins = found.phones.edges[[span.first for span in found.words]]
            firsts = np.cumsum([1, *(len(word.phones) + 1 for word in words[:-1])])
            if np.abs(begins - [stated[at].begin for at in firsts]).max() <= MOST_MISPLACED_S / min(rate, 1.0):
                yield sound, found.phones


@cache
def _speakers() -> tuple[NeuralVoice, Aligner]:
    return NeuralVoice({}), Aligner()


def phone_labels(phones: PhoneSequence, n_frames: int) -> NDArray[np.str_]:
    """Phone (T,) in the middle of each frame."""
    at = np.searchsorted(phones.edges, np.arange(n_frames) * STEP_S, side="right") - 1
    return np.array(phones.phones)[np.clip(at, 0, len(phones) - 1)]
