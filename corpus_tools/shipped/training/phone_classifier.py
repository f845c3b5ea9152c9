"""Training of the classifiers of frames (`tts2face.models.phone_classifier`), without phone edges set by hand.

That of the voice ``heart`` begins with the durations that the voice states and learns its own edges again (embedded
training, Young et al. 2006). That of recordings begins with the voice's speech, which is damaged
(`shipped.training.damage`); what it has learnt aligns another voice and recorded sentences, whose words' times are
known, and it is trained on all, again and again.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.prompts.prompts import shipped_sentences
from corpus_tools.shipped.training.damage import Damaged, damaged_copies
from corpus_tools.shipped.training.epochs import fit_epochs
from corpus_tools.shipped.training.spoken_material import KnownSpeech, spoken_material
from lexicon.dictionary import cmudict_words
from lexicon.sequence import SILENCE, PhoneSequence, enforce_increasing
from tts2face.models.phone_classifier import PhoneClassifier
from tts2face.sound.alignment import Aligner, recording_features
from tts2face.sound.heart import NeuralVoice
from tts2face.sound.prosody import Prosody
from tts2face.sound.recogniser import FEATURES, FRAME_S, PhoneRecogniser, levelled
from tts2face.sound.segments import STEP_S, StatedPhone, find_edges, frame_features
from tts2face.sound.spikes import NEVER, find_spikes
from tts2face.types import Progress, Waveform

N_RANDOM = 800  # texts of words in random order
N_WORDS = (3, 9)
ENDS, COMMA_SHARE = (".", ".", "?", "!"), 0.15
RATES = (1.0, 1.0, 0.5, 0.7, 0.85, 1.2, 1.5, 2.0)
N_ROUNDS = 3  # in which edges and classifier of the voice are found from each other
N_UNITS, N_EPOCHS = 128, 12
N_UNITS_OF_RECORDINGS = 192
LEARNING_RATES = (1.5e-3, 7.5e-5)  # in the first and the last epoch
LEAST_SPREAD, WEIGHT_DECAY = 0.05, 1e-4
TEST_SHARE = 20  # every twentieth text measures the accuracy
PRIOR_SHARE = 0.6  # of the log frequencies of phones that is taken out: the search knows which phones are there
LEAST_DURATION_S, LEAST_DEVIATION = 0.02, 0.3
EPOCHS_OF_RECORDINGS = (12, 12, 12, 20)  # of rounds in which edges of other speech and the classifier are found
N_DAMAGED = 2  # times that each text is learnt
FRAME_SHARE, SILENCE_SHARE = 0.45, 0.33  # of frames, and of the silent ones among them, that are learnt
SURE = 0.5  # of a spike whose delay is measured
Report = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Features (T, K) of frames, their phones (T,), and whether they are left for the test of what is learnt (T,)."""

    features: NDArray[np.float16]
    labels: NDArray[np.str_]
    is_test: NDArray[np.bool_]


def train_voice_classifier(*, on_progress: Progress, report: Report) -> PhoneClassifier:
    """Classifier of the voice ``heart``; `report` receives its accuracy on texts that it has not learnt."""
    voice, texts = NeuralVoice({}), training_texts()
    parts: list[tuple[Waveform, Sequence[StatedPhone], bool]] = []
    for at, text in enumerate(texts):
        spoken = voice.parts(text, Prosody(RATES[at % len(RATES)]), seed=at)
        parts += [(part.plain, part.stated, at % TEST_SHARE == 0) for part in spoken]
        on_progress(at + 1, len(texts))
    seen = [frame_features(sound).astype(np.float16) for sound, *_ in parts]
    is_test = np.concatenate([np.full(len(observed), test) for observed, (*_, test) in zip(seen, parts, strict=True)])
    features = np.concatenate(seen)
    aligned = [_stated_sequence(stated, sound.duration) for sound, stated, _ in parts]
    for _ in range(N_ROUNDS):
        labels = [phone_labels(phones, len(observed)) for phones, observed in zip(aligned, seen, strict=True)]
        classifier = _fit(Frames(features, np.concatenate(labels), is_test), (N_UNITS, N_EPOCHS), report)
        aligned = [_found_sequence(sound, stated, classifier) for sound, stated, _ in parts]
    return replace(classifier, durations=_durations(classifier.inventory, aligned))


def train_recording_classifier(recordings: Path, *, on_progress: Progress, report: Report) -> PhoneClassifier:
    """Classifier of recordings of anybody.

    Parameters
    ----------
    recordings
        As for `corpus_tools.shipped.training.spoken_material.spoken_material`.
    """
    rng, recogniser = np.random.default_rng(0), PhoneRecogniser()
    stated, others = spoken_material(recordings, rng)
    sounds = [*(item.sound for item in stated), *(other.sound for other in others)]
    known: list[PhoneSequence | None] = [*(item.phones for item in stated), *([None] * len(others))]
    lessons = _lessons(sounds, rng, recogniser, on_progress)
    delays = _delays(stated, recogniser)
    first, *rounds = EPOCHS_OF_RECORDINGS
    classifier = _fit_lessons(lessons, known, delays, first, report)
    for n_epochs in rounds:
        aligner = Aligner(classifier)
        for at, other in enumerate(others, len(stated)):
            known[at] = other.align(aligner) or known[at]
        classifier = _fit_lessons(lessons, known, delays, n_epochs, report)
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


def phone_labels(phones: PhoneSequence, n_frames: int) -> NDArray[np.str_]:
    """Phone (T,) in the middle of each frame."""
    at = np.searchsorted(phones.edges, np.arange(n_frames) * STEP_S, side="right") - 1
    return np.array(phones.phones)[np.clip(at, 0, len(phones) - 1)]


def _stated_sequence(stated: Sequence[StatedPhone], duration: float) -> PhoneSequence:
    """Phones as the voice states them; pauses without punctuation are left out."""
    kept = [item for item in stated if item.is_marked or not item.may_be_skipped]
    edges = np.array([0.0, *(recording.start for recording in kept[1:]), duration])
    return PhoneSequence([recording.label for recording in kept], enforce_increasing(np.minimum(edges, duration)))


def _found_sequence(sound: Waveform, stated: Sequence[StatedPhone], classifier: PhoneClassifier) -> PhoneSequence:
    """Phones as they are found in the sound."""
    edges = find_edges(sound, stated, classifier)
    kept = [at for at, item in enumerate(stated) if not item.may_be_skipped or edges[at + 1] > edges[at]]
    return PhoneSequence([stated[at].label for at in kept], [*edges[kept], sound.duration])


def _fit(frames: Frames, size: tuple[int, int], report: Report) -> PhoneClassifier:
    """Classifier of frames by a number of units, in a number of epochs; durations and delays are not known yet."""
    from sklearn.neural_network import MLPClassifier

    features, labels, is_test = frames.features, frames.labels, frames.is_test
    learnt = features[~is_test].astype(np.float32)
    mean, scale = learnt.mean(axis=0), 1.0 / np.maximum(learnt.std(axis=0), LEAST_SPREAD)
    scaled = (learnt - mean) * scale
    model = MLPClassifier((size[0],), batch_size=512, alpha=WEIGHT_DECAY)
    fit_epochs(model, scaled, labels[~is_test], LEARNING_RATES, size[1])
    inventory = tuple(model.classes_.tolist())
    weights, biases = (
        (layers[0].astype(np.float32), layers[1].astype(np.float32)) for layers in (model.coefs_, model.intercepts_)
    )
    unknown = np.zeros((len(inventory), 2), np.float32)
    classifier = PhoneClassifier(inventory, mean, scale, weights, biases, unknown, unknown[:, 0])
    found = np.array(inventory)[classifier.log_probabilities(features[is_test].astype(np.float32)).argmax(axis=1)]
    report(f"{len(features)} frames; of those of other texts {np.mean(found == labels[is_test]):.1%} are told rightly")
    return classifier


def _fit_lessons(
    lessons: "Sequence[_Lesson]",
    known: Sequence[PhoneSequence | None],
    delays: Mapping[str, float],
    n_epochs: int,
    report: Report,
) -> PhoneClassifier:
    """Classifier of damaged speech whose phones are known; it weighs them as if most of them were equally frequent."""
    rng, parts = np.random.default_rng(0), []
    for lesson in lessons:
        if (phones := known[lesson.number]) is not None:
            labels = lesson.labels(phones)
            kept = (labels != SILENCE) | (rng.random(len(labels)) < SILENCE_SHARE)
            parts.append(
                Frames(lesson.features[kept], labels[kept], np.full(kept.sum(), lesson.number % TEST_SHARE == 0))
            )
    frames = Frames(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(Frames)))
    classifier = _fit(frames, (N_UNITS_OF_RECORDINGS, n_epochs), report)
    counts = np.unique(frames.labels[~frames.is_test], return_counts=True)[1]  # sorted, as the inventory
    inner, outer = classifier.biases
    even = (outer - PRIOR_SHARE * np.log(counts)).astype(np.float32)
    usual = float(np.median(list(delays.values())))
    return replace(
        classifier,
        biases=(inner, even),
        durations=_durations(classifier.inventory, [phones for phones in known if phones is not None]),
        delays=np.array([delays.get(label, usual) for label in classifier.inventory], np.float32),
    )


def _durations(inventory: Sequence[str], sequences: Sequence[PhoneSequence]) -> NDArray[np.float32]:
    """Mean and deviation (P, 2) of the log seconds of phones."""
    logs: dict[str, list[float]] = {label: [] for label in inventory}
    for sequence in sequences:
        for label, seconds in zip(sequence.phones, sequence.durations, strict=True):
            logs[label].append(float(np.log(max(seconds, LEAST_DURATION_S))))
    everything = [value for values in logs.values() for value in values]
    known = [logs[label] or everything for label in inventory]
    return np.array([[np.mean(recording), max(np.std(recording), LEAST_DEVIATION)] for recording in known], np.float32)


def _delays(stated: Sequence[KnownSpeech], recogniser: PhoneRecogniser) -> dict[str, float]:
    """Median seconds from the middle of each phone to the instant at which the recogniser says it."""
    apart: dict[str, list[float]] = {}
    for item in stated:
        phones = item.phones
        said = [at for at, label in enumerate(phones.phones) if label != SILENCE]
        labels = [phones.phones[at] for at in said]
        heard = recogniser.hear(item.sound).log_probabilities(tuple(labels))
        spikes = find_spikes(heard, [[list(range(len(labels)))]], NEVER)
        moments = (np.arange(len(spikes)) + 0.5) * FRAME_S
        middles = (phones.edges[said] + phones.edges[[at + 1 for at in said]]) / 2
        for label, spike, middle in zip(labels, spikes.T, middles, strict=True):
            if spike.max() > SURE:
                apart.setdefault(label, []).append(float(spike @ moments / spike.sum() - middle))
    return {label: float(np.median(values)) for label, values in apart.items()}


@dataclass(frozen=True, slots=True, eq=False)
class _Lesson:
    """Damaged speech, which one it was, and features (T, K) of some frames with their numbers (T,)."""

    damaged: Damaged
    number: int
    features: NDArray[np.float16]
    frames: NDArray[np.int64]

    def labels(self, phones: PhoneSequence) -> NDArray[np.str_]:
        """Phones (T,) of the frames, from those of the speech before it was damaged."""
        return phone_labels(self.damaged.phones(phones), int(self.frames.max()) + 1)[self.frames]


def _lessons(
    sounds: Sequence[Waveform], rng: np.random.Generator, recogniser: PhoneRecogniser, on_progress: Progress
) -> list[_Lesson]:
    """Each sound several times, damaged in several ways."""
    found = []
    for at, (number, damaged) in enumerate(damaged_copies(sounds, N_DAMAGED, rng)):
        sound = levelled(damaged.sound)
        seen = recording_features(sound, recogniser.hear(sound).log_probabilities(FEATURES))
        frames = np.flatnonzero(rng.random(len(seen)) < FRAME_SHARE)
        found.append(_Lesson(damaged, number, seen[frames].astype(np.float16), frames))
        on_progress(at + 1, N_DAMAGED * len(sounds))
    return found
