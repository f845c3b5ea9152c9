"""Training of the classifiers of frames (`tts2face.models.phone_classifier`), without phone edges set by hand.

That of the voice ``heart`` begins with the durations that the voice states and learns its own edges again (embedded
training, Young et al. 2006). That of recordings begins with the voice's speech, which is damaged
(`corpus_tools.training.damage`); what it has learnt aligns another voice and recorded sentences, whose words' times are
known, and it is trained on all.
"""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.prompts.prompts import shipped_sentences
from corpus_tools.recordings.folder import read_word_times
from corpus_tools.training.damage import SpokenText, damage
from lexicon.dictionary import cmudict_words
from lexicon.errors import DataError
from lexicon.sequence import SILENCE, PhoneSequence, enforce_increasing
from tts2face.models.phone_classifier import PhoneClassifier
from tts2face.sound.alignment import Aligner, levelled, recording_features
from tts2face.sound.heart import NeuralVoice
from tts2face.sound.recogniser import FEATURES, FRAME_S, PhoneRecogniser
from tts2face.sound.segments import RATE, STEP_S, StatedPhone, find_edges, frame_features
from tts2face.sound.spikes import NEVER, find_spikes
from tts2face.sound.transcript import pronounce_transcript
from tts2face.sound.voice import pronounce_content
from tts2face.sound.voice_pool import load_voice
from tts2face.types import Progress, Speech, Waveform
from tts2face.video.media import read_sound

N_RANDOM = 800  # texts of words in random order
N_WORDS = (3, 9)
ENDS, COMMA_SHARE = (".", ".", "?", "!"), 0.15
RATES = (1.0, 1.0, 0.5, 0.7, 0.85, 1.2, 1.5, 2.0)
N_ROUNDS = 3  # in which edges and classifier of the voice are found from each other
N_UNITS, N_EPOCHS = 128, 12
N_UNITS_OF_RECORDINGS = 192
LEAST_SPREAD, WEIGHT_DECAY = 0.05, 1e-4
TEST_SHARE = 20  # every twentieth text tells the accuracy
PRIOR_SHARE = 0.6  # of the log frequencies of phones that is taken out: the search knows which phones are there
LEAST_DURATION_S, LEAST_DEVIATION, LEAST_SECONDS = 0.02, 0.3, 1.0
SPEECH_RATES = (0.8, 0.9, 1.0, 1.0, 1.15, 1.3)
N_TEXTS, N_OTHER, OTHER_VOICE = 420, 260, "joe"  # of both voices
RECORDED_STEP = 3  # every third recorded sentence
N_DAMAGED = 2  # times that each text is learnt
FRAME_SHARES = 0.15, 0.45  # of silence and of speech that are learnt
SURE = 0.5  # of a spike whose delay is measured
Told = Callable[[str], None]


@dataclass(frozen=True, slots=True, eq=False)
class Frames:
    """Features (T, K) of frames, their phones (T,), and whether they are left for the test of what is learnt (T,)."""

    features: NDArray[np.float16]
    labels: NDArray[np.str_]
    is_test: NDArray[np.bool_]


def train_voice_classifier(*, on_progress: Progress, report: Told) -> PhoneClassifier:
    """Classifier of the voice ``heart``; `report` is told its accuracy on texts that it has not learnt."""
    voice, texts = NeuralVoice({}), training_texts()
    parts: list[tuple[Waveform, Sequence[StatedPhone], bool]] = []
    for at, text in enumerate(texts):
        spoken = voice.parts(text, rate=RATES[at % len(RATES)], seed=at)
        parts += [(sound, stated, at % TEST_SHARE == 0) for sound, _, stated in spoken]
        on_progress(at + 1, len(texts))
    seen = [frame_features(sound).astype(np.float16) for sound, *_ in parts]
    is_test = np.concatenate([np.full(len(one), test) for one, (*_, test) in zip(seen, parts, strict=True)])
    features = np.concatenate(seen)
    aligned = [_stated_sequence(stated, sound.duration) for sound, stated, _ in parts]
    for _ in range(N_ROUNDS):
        labels = [phone_labels(phones, len(one)) for phones, one in zip(aligned, seen, strict=True)]
        classifier = _fit(Frames(features, np.concatenate(labels), is_test), N_UNITS, report)
        aligned = [_found_sequence(sound, stated, classifier) for sound, stated, _ in parts]
    return replace(classifier, durations=_durations(classifier.inventory, aligned))


def train_recording_classifier(recordings: Path, *, on_progress: Progress, report: Told) -> PhoneClassifier:
    """Classifier of recordings of anybody.

    Parameters
    ----------
    recordings
        Folder of GRID's talker s1, with the times of the words.
    """
    rng, texts = np.random.default_rng(0), list(dict.fromkeys(training_texts()))
    rng.shuffle(texts)
    voice, recogniser = load_voice("heart", "en-us"), PhoneRecogniser()
    spoken = [_speech(voice.speak(text, rate=float(rng.choice(SPEECH_RATES)))) for text in texts[:N_TEXTS]]
    delays = _delays(spoken, recogniser)
    frames = _damaged_frames(spoken, rng, recogniser, on_progress)
    aligner = Aligner(_completed(_fit(frames, N_UNITS_OF_RECORDINGS, report), spoken, delays))
    others = [*_spoken_by_another(texts[N_TEXTS : N_TEXTS + N_OTHER], aligner, rng), *_recorded(recordings, aligner)]
    more = _damaged_frames(others, rng, recogniser, on_progress)
    frames = Frames(*(np.concatenate([getattr(part, one.name) for part in (frames, more)]) for one in fields(Frames)))
    return _completed(_fit(frames, N_UNITS_OF_RECORDINGS, report), [*spoken, *others], delays)


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
    kept = [one for one in stated if one.is_marked or not one.may_be_skipped]
    edges = np.array([0.0, *(one.begin for one in kept[1:]), duration])
    return PhoneSequence([one.label for one in kept], enforce_increasing(np.minimum(edges, duration)))


def _found_sequence(sound: Waveform, stated: Sequence[StatedPhone], classifier: PhoneClassifier) -> PhoneSequence:
    """Phones as they are found in the sound."""
    edges = find_edges(sound, stated, classifier)
    kept = [at for at, one in enumerate(stated) if not one.may_be_skipped or edges[at + 1] > edges[at]]
    return PhoneSequence([stated[at].label for at in kept], [*edges[kept], sound.duration])


def _fit(frames: Frames, n_units: int, report: Told) -> PhoneClassifier:
    """Classifier of frames; durations and delays are not known yet."""
    from sklearn.neural_network import MLPClassifier

    features, labels, is_test = frames.features, frames.labels, frames.is_test
    learnt = features[~is_test].astype(np.float32)
    mean, scale = learnt.mean(axis=0), 1.0 / np.maximum(learnt.std(axis=0), LEAST_SPREAD)
    model = MLPClassifier(
        (n_units,), batch_size=512, learning_rate_init=2e-3, max_iter=N_EPOCHS, alpha=WEIGHT_DECAY, random_state=0
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it has not converged after its epochs
        model.fit((learnt - mean) * scale, labels[~is_test])
    inventory = tuple(model.classes_.tolist())
    weights, biases = (
        (layers[0].astype(np.float32), layers[1].astype(np.float32)) for layers in (model.coefs_, model.intercepts_)
    )
    unknown = np.zeros((len(inventory), 2), np.float32)
    classifier = PhoneClassifier(inventory, mean, scale, weights, biases, unknown, unknown[:, 0])
    found = np.array(inventory)[classifier.log_probabilities(features[is_test].astype(np.float32)).argmax(axis=1)]
    report(f"{len(features)} frames; of those of other texts {np.mean(found == labels[is_test]):.1%} are told rightly")
    return classifier


def _completed(
    classifier: PhoneClassifier, spoken: Sequence[SpokenText], delays: Mapping[str, float]
) -> PhoneClassifier:
    """The classifier with durations and delays, which tells phones as if most of them were equally frequent."""
    sequences = [one.phones for one in spoken]
    seconds = dict.fromkeys(classifier.inventory, LEAST_SECONDS)
    for one in sequences:
        for label, duration in zip(one.phones, one.durations, strict=True):
            seconds[label] += float(duration) * (FRAME_SHARES[0] / FRAME_SHARES[1] if label == SILENCE else 1.0)
    inner, outer = classifier.biases
    even = (outer - PRIOR_SHARE * np.log(list(seconds.values()))).astype(np.float32)
    usual = float(np.median(list(delays.values())))
    return replace(
        classifier,
        biases=(inner, even),
        durations=_durations(classifier.inventory, sequences),
        delays=np.array([delays.get(label, usual) for label in classifier.inventory], np.float32),
    )


def _durations(inventory: Sequence[str], sequences: Sequence[PhoneSequence]) -> NDArray[np.float32]:
    """Mean and deviation (P, 2) of the log seconds of phones."""
    logs: dict[str, list[float]] = {label: [] for label in inventory}
    for one in sequences:
        for label, seconds in zip(one.phones, one.durations, strict=True):
            logs[label].append(float(np.log(max(seconds, LEAST_DURATION_S))))
    everything = [value for values in logs.values() for value in values]
    known = [logs[label] or everything for label in inventory]
    return np.array([[np.mean(one), max(np.std(one), LEAST_DEVIATION)] for one in known], np.float32)


def _speech(spoken: Speech) -> SpokenText:
    return SpokenText(_resampled(spoken.waveform), spoken.phones)


def _resampled(sound: Waveform) -> Waveform:
    import soxr

    return Waveform(np.clip(soxr.resample(sound.samples, sound.rate, RATE), -1.0, 1.0), RATE)


def _delays(spoken: Sequence[SpokenText], recogniser: PhoneRecogniser) -> dict[str, float]:
    """Median seconds from the middle of each phone to the instant at which the recogniser says it."""
    apart: dict[str, list[float]] = {}
    for one in spoken:
        known = [at for at, label in enumerate(one.phones.phones) if label != SILENCE]
        labels = [one.phones.phones[at] for at in known]
        heard = recogniser.hear(levelled(one.sound)).log_probabilities(tuple(labels))
        spikes = find_spikes(heard, [[list(range(len(labels)))]], NEVER)
        moments = (np.arange(len(spikes)) + 0.5) * FRAME_S
        middles = (one.phones.edges[known] + one.phones.edges[[at + 1 for at in known]]) / 2
        for label, spike, middle in zip(labels, spikes.T, middles, strict=True):
            if spike.max() > SURE:
                apart.setdefault(label, []).append(float(spike @ moments / spike.sum() - middle))
    return {label: float(np.median(values)) for label, values in apart.items()}


def _damaged_frames(
    spoken: Sequence[SpokenText], rng: np.random.Generator, recogniser: PhoneRecogniser, on_progress: Progress
) -> Frames:
    """Some frames of damaged speech."""
    features, labels, is_test = [], [], []
    for at in range(N_DAMAGED * len(spoken)):
        one = damage(spoken[at % len(spoken)], spoken, rng)
        sound = levelled(one.sound)
        seen = recording_features(sound, recogniser.hear(sound).log_probabilities(FEATURES))
        told = phone_labels(one.phones, len(seen))
        kept = rng.random(len(seen)) < np.where(told == SILENCE, *FRAME_SHARES)
        features.append(seen[kept].astype(np.float16))
        labels.append(told[kept])
        is_test.append(np.full(int(kept.sum()), at % len(spoken) % TEST_SHARE == 0))
        on_progress(at + 1, N_DAMAGED * len(spoken))
    return Frames(np.concatenate(features), np.concatenate(labels), np.concatenate(is_test))


def _spoken_by_another(texts: Sequence[str], aligner: Aligner, rng: np.random.Generator) -> Iterator[SpokenText]:
    """Texts in the voice `OTHER_VOICE`, aligned."""
    voice = load_voice(OTHER_VOICE, "en-us")
    for text in texts:
        sound = _resampled(voice.sound(text, rate=float(rng.choice(SPEECH_RATES))))
        words = [(word.text, [tuple(word.phones)]) for word in pronounce_content(text, "en-us", {})]
        with suppress(DataError):  # it speaks too quickly for its words
            yield SpokenText(sound, aligner.align(sound, words).phones)


def _recorded(folder: Path, aligner: Aligner) -> Iterator[SpokenText]:
    """Recorded sentences, aligned within the known times of their words."""
    for path in sorted((folder / "align").glob("*.align"))[::RECORDED_STEP]:
        cues = read_word_times(path)
        words = pronounce_transcript(" ".join(cue.text for cue in cues), "en-us")
        sound = read_sound(folder / "clips" / f"{path.stem}.mkv", RATE)
        times = [(cue.begin, cue.end) for cue in cues]
        with suppress(DataError):  # a known word is shorter than its phones
            if len(words) == len(cues):
                yield SpokenText(sound, aligner.align(sound, words, times).phones)
