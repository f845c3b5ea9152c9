"""How head, brows and lids follow speech: the course of a sentence, accents, turns and blinks, of a made face.

Beside each measure stands what people do, from tracks of readers and of a public speaker with the jaw's part in the
tracked pose taken out (decision 264). Chin down is positive; brows and eyes up are.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfiltfilt

from corpus_tools.studies.gestures.blinks import find_blinks
from lexicon.given_phones import TextWord
from lexicon.normalize import spoken_form
from tts2face.face.landmarks import landmark_motion, landmark_positions
from tts2face.gestures.speech_plan import SoundFeatures, SpokenSentence, plan_speech, vowel_scores
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray
from tts2face.request import Idle, Request
from tts2face.session.session import Session
from tts2face.types import Clip

Statistic = Callable[[FloatArray], np.floating | float]

# Sentences of the Harvard list (IEEE 1969), of which one or two have what most sentences have.
SENTENCES = (
    "The birch canoe slid on the smooth planks.", "Glue the sheet to the dark blue background.",
    "It's easy to tell the depth of a well.", "These days a chicken leg is a rare dish.",
    "Rice is often served in round bowls.", "The juice of lemons makes fine punch.",
    "The box was thrown beside the parked truck.", "The hogs were fed chopped corn and garbage.",
    "Four hours of steady work faced us.", "A large size in stockings is hard to sell.",
    "The boy was there when the sun rose.", "A rod is used to catch pink salmon.",
    "The source of the huge river is the clear spring.", "Kick the ball straight and follow through.",
    "Help the woman get back to her feet.", "A pot of tea helps to pass the evening.",
    "Smoky fires lack flame and heat.", "The soft cushion broke the man's fall.",
    "The salt breeze came across from the sea.", "The girl at the booth sold fifty bonds.",
    "The small pup gnawed a hole in the sock.", "The fish twisted and turned on the bent hook.",
    "Press the pants and sew a button on the vest.", "The swan dive was far short of perfect.",
)  # fmt: skip
MONOLOGUE = (
    "When I came home last night, I found that the door of the kitchen was open. Nobody was there, but somebody had "
    "made tea and left the cups on the table. I called my brother, and he said that he knew nothing at all about it. "
    "Then I remembered the neighbour across the street who has a key to the house. She had been waiting for a parcel "
    "all afternoon, and she was terribly cold. We laughed about it for a long time, and I made another pot of tea. It "
    "is good to have people next door who look after you and the house. Next week she will move to another town, which "
    "is a great pity. I shall miss her very much, and the cat will miss her even more. Perhaps the new people will be "
    "just as kind as she has always been."
)
BAND_HZ, BROW_HZ = (0.5, 5.0), (0.3, 5.0)
COURSE_HZ = (0.03, 1.5)
COURSE_AT = (0.0, 0.25, 0.9, 1.0)  # of a sentence
SENTENCE_S = (2.5, 7.5)  # of those whose course is measured
ACCENT_S = np.linspace(-0.04, 0.12, 9)  # about the middle of a vowel
TURN_S, TURN_GAP_S = (-0.12, 0.20), 0.25  # about a content word, and least time between two turns of the head
N_RESAMPLED = 500
N_MONOLOGUES = 6  # with different seeds
SILENT_S = 120.0
EYE_MM = (0.0, 54.0, 85.0)  # the eyes from the pivot of the head
BROW_LANDMARKS = (70, 63, 105, 66, 107, 46, 53, 52, 65, 55, 300, 293, 334, 296, 336, 276, 283, 282, 295, 285)
EYE_CORNERS, EYES_APART_MM = (33, 263), 88.9  # outer ones, and their distance to which faces are scaled


# Ranges: from a third of what a public speaker does to all of it; readers and a speaker for the rest (decision 264).
PEOPLE_PITCH = ((0.3, 2.2), (-2.4, -0.8), (1.1, 3.4), (0.8, 2.5))
PEOPLE_BROWS = ((-1.3, -0.1), (0.27, 0.8), (-1.1, -0.3), (-1.1, -0.3))
ACCENTS = (
    ("pitch", "pitch", "degrees", (-1.2, -0.1)),
    ("eyes_up", "eyes up", "mm", (0.3, 2.1)),
    ("brows", "brows", "mm", (0.0, 0.3)),
)


@dataclass(frozen=True, slots=True, eq=False)
class SpeakingFace:
    """Motion of a clip with what is said in it, in seconds.

    Parameters
    ----------
    pitch, eyes_up, brows, closure : (T,)
        Degrees, mm, mm, and share of shut lids.
    vowels : (N, 2)
        Middle and prominence.
    """

    fps: float
    pitch: FloatArray
    eyes_up: FloatArray
    brows: FloatArray
    closure: FloatArray
    vowels: FloatArray
    sentences: tuple[SpokenSentence, ...]

    @property
    def times(self) -> FloatArray:
        """(T,) seconds."""
        return np.arange(len(self.pitch)) / self.fps


def speaking_face(clip: Clip, text: str, face: Face) -> SpeakingFace:
    """Measured motion of a clip of an English text on a face with the shapes of the clip."""
    script = tuple(map(TextWord, spoken_form(text, "en-us").split()))
    places = landmark_positions(face)
    row = {int(number): at for at, number in enumerate(face.landmarks)}
    columns = np.array([face.shape_names.index(name) for name in clip.motion.channels])
    moves = landmark_motion(face, columns)[[row[number] for number in BROW_LANDMARKS if number in row], 1].mean(axis=0)
    apart = float(np.linalg.norm(places[row[EYE_CORNERS[0]]] - places[row[EYE_CORNERS[1]]]))
    head = clip.head.values.astype(np.float64)
    down = head[:, 0]
    eyes = head[:, 4] + EYE_MM[1] * np.cos(down) - EYE_MM[2] * np.sin(down)
    scores = [vowel for word in vowel_scores(clip.speech, SoundFeatures.of(clip.speech.waveform)) for vowel in word]
    return SpeakingFace(
        clip.fps,
        np.degrees(down),
        eyes,
        EYES_APART_MM / apart * (clip.motion.values.astype(np.float64) @ moves),
        _closure(clip),
        np.array([[time, score] for score, time in scores]),
        plan_speech(clip.speech, script, "en-us").sentences,
    )


def _closure(clip: Clip) -> FloatArray:
    lids = [clip.motion.channels.index(f"eyeBlink{side}") for side in ("Left", "Right")]
    return np.asarray(clip.motion.values[:, lids].mean(axis=1), np.float64)


def band(values: FloatArray, fps: float, limits: tuple[float, float]) -> FloatArray:
    """Values (T,) within a band of frequencies, Butterworth of the second order in both directions."""
    n = int(1.5 * fps)
    padded = np.concatenate([np.full(n, values[:5].mean()), values, np.full(n, values[-5:].mean())])
    return np.asarray(sosfiltfilt(butter(2, limits, "bandpass", fs=fps, output="sos"), padded)[n:-n], np.float64)


@dataclass(frozen=True, slots=True)
class SpeechMeasure:
    """A measure with its 95 % interval over clips or sentences, and the range of what people do."""

    name: str
    unit: str
    value: float
    low: float
    high: float
    people: tuple[float, float]

    @property
    def is_met(self) -> bool:
        """Whether the value lies within the people's range."""
        return self.people[0] <= self.value <= self.people[1]


def measure_speech(short: Sequence[SpeakingFace], long: Sequence[SpeakingFace], seed: int = 0) -> list[SpeechMeasure]:
    """Measures of clips of single sentences, and of monologues."""
    rows = list[SpeechMeasure]()

    def add(name: str, unit: str, samples: FloatArray, people: tuple[float, float]) -> None:
        rows.append(SpeechMeasure(name, unit, float(samples.mean()), *_interval(samples, seed), people))

    pitch, brows = (np.concatenate([courses(face, signal) for face in long]) for signal in ("pitch", "brows"))
    for at, share in enumerate(COURSE_AT):
        add(f"pitch at {share:g} of a sentence", "degrees", pitch[:, at], PEOPLE_PITCH[at])
    for at, share in enumerate(COURSE_AT):
        add(f"brows at {share:g} of a sentence", "mm", brows[:, at], PEOPLE_BROWS[at])
    every = [*short, *long]
    for signal, name, unit, people in ACCENTS:
        add(f"accented minus weak vowels: {name}", unit, np.array([accented(face, signal) for face in every]), people)
    turned = [turns_at_words(face) for face in every]
    down = np.concatenate([found for found in turned if len(found)])
    add("turns at content words that go down", "%", 100 * down, (15, 45))
    add(
        "turns of the head",
        "a second",
        np.array([len(turns(face)) / len(face.pitch) * face.fps for face in long]),
        (1.0, 2.2),
    )
    add("brow height, deviation", "mm", np.array([band(f.brows, f.fps, BROW_HZ).std() for f in long]), (0.37, 1.28))
    return rows


def _interval(samples: FloatArray, seed: int, statistic: Statistic = np.mean) -> tuple[float, float]:
    """95 % interval of a statistic of samples (n,), by resampling."""
    chosen = np.random.default_rng([seed, 5]).integers(0, len(samples), (N_RESAMPLED, len(samples)))
    low, high = np.quantile([statistic(samples[draw]) for draw in chosen], [0.025, 0.975]).tolist()
    return low, high


def spread(samples: FloatArray) -> float:
    """Coefficient of variation."""
    return float(samples.std() / samples.mean())


def courses(face: SpeakingFace, signal: str) -> FloatArray:
    """(S, 4) slow part of a signal at `COURSE_AT` of each sentence of `SENTENCE_S`."""
    slow = band(getattr(face, signal), face.fps, COURSE_HZ)
    spans = [sentence.span for sentence in face.sentences]
    chosen = [span for span in spans if SENTENCE_S[0] <= span.end - span.start <= SENTENCE_S[1]]
    times = np.array([[span.start + share * (span.end - span.start) for share in COURSE_AT] for span in chosen])
    return np.asarray(np.interp(times.ravel(), face.times, slow).reshape(times.shape))


def accented(face: SpeakingFace, signal: str) -> float:
    """Mean of a signal's quick part about the third of the vowels with most prominence, less that with least."""
    moved = band(getattr(face, signal), face.fps, BAND_HZ)
    low, high = np.quantile(face.vowels[:, 1], [1 / 3, 2 / 3])

    def mean(chosen: NDArray[np.bool_]) -> float:
        return float(np.interp(np.add.outer(face.vowels[chosen, 0], ACCENT_S), face.times, moved).mean())

    return mean(face.vowels[:, 1] >= high) - mean(face.vowels[:, 1] <= low)


def turns(face: SpeakingFace) -> list[tuple[float, bool]]:
    """Seconds at which the head turns back, more than one standard deviation from the middle, and whether chin down."""
    moved = band(face.pitch, face.fps, BAND_HZ)
    least, size = moved.std(), np.abs(moved)
    inner = 1 + np.flatnonzero((size[1:-1] >= size[:-2]) & (size[1:-1] > size[2:]) & (size[1:-1] >= least))
    chosen: list[int] = []
    for at in inner[np.argsort(-size[inner], kind="stable")].tolist():
        if all(abs(at - other) > TURN_GAP_S * face.fps for other in chosen):
            chosen.append(at)
    return [(at / face.fps, bool(moved[at] > 0)) for at in sorted(chosen)]


def turns_at_words(face: SpeakingFace) -> FloatArray:
    """(M,) 1 where the first turn about a content word is chin down, else 0."""
    found = turns(face)
    near = [
        [is_down for time, is_down in found if TURN_S[0] <= time - accent.time <= TURN_S[1]]
        for sentence in face.sentences
        for accent in sentence.accents
    ]
    return np.array([float(ways[0]) for ways in near if ways])


def blink_measures(speaking: Sequence[SpeakingFace], silent: Clip) -> Iterator[SpeechMeasure]:
    """Rates of blinks in speech and in silence, and how their intervals vary."""
    found = [find_blinks(face.closure, np.array([len(face.closure)], np.int32), face.fps) for face in speaking]
    rates = np.array([blinks.per_minute for blinks in found])
    intervals = np.concatenate([blinks.intervals for blinks in found])
    quiet = find_blinks(_closure(silent), np.array([len(silent.motion)], np.int32), silent.fps)
    minutes = 60.0 / np.maximum(quiet.intervals, 0.1)
    yield SpeechMeasure("blinks in speech", "a minute", float(rates.mean()), *_interval(rates, 0), (16.0, 36.0))
    yield SpeechMeasure("blinks in silence", "a minute", _rate(minutes), *_interval(minutes, 0, _rate), (10.0, 24.0))
    name, limits = "variation of intervals of blinks", _interval(intervals, 0, spread)
    yield SpeechMeasure(name, "", spread(intervals), *limits, (0.65, 0.95))


def _rate(rates: FloatArray) -> float:
    """Rate of events whose intervals have these rates."""
    return float(1.0 / np.mean(1.0 / rates))


def study_speech(session: Session, n_monologues: int = N_MONOLOGUES) -> tuple[SpeechMeasure, ...]:
    """Measures of a session's default style: a clip of each sentence, monologues, and two minutes of silence."""
    face = session.face.mesh
    short = [speaking_face(session.clip(text, seed=at), text, face) for at, text in enumerate(SENTENCES)]
    long = [speaking_face(session.clip(MONOLOGUE, seed=at), MONOLOGUE, face) for at in range(n_monologues)]
    silent = session.clip(Request(source=Idle(SILENT_S), seed=1))
    return (*measure_speech(short, long), *blink_measures(long, silent))


def speech_rows(study: Sequence[SpeechMeasure]) -> Iterator[tuple[str, str, str, str, str]]:
    """Name, unit, value, 95 % interval, and what people do, of each measure."""
    for measure in study:
        low, high = measure.people
        interval = f"{measure.low:.2f} to {measure.high:.2f}"
        yield measure.name, measure.unit, f"{measure.value:.2f}", interval, f"{low:g} to {high:g}"
