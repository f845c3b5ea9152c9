"""Bilabials close on every face, in every phone of any text, and no shape moves faster than a person's."""

import numpy as np
import pytest
from numpy.typing import NDArray

from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.face.gestures import gesture_face
from tts2face.face.landmarks import landmark_motion, landmark_positions, scatter_landmarks
from tts2face.face.lip_constraints import build_lip_constraints
from tts2face.lips.articulation_tracks import MIN_CLOSURE_S, seconds_from_closure
from tts2face.lips.exemplar import ExemplarModel, select_tokens
from tts2face.lips.mouth_limits import LARGEST_SPEED_PER_S, close_lips, largest_gaps, limit_speed
from tts2face.lips.options import SynthesisOptions
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import inner_lip_gaps
from tts2face.models.palette import EXPRESSIONS
from tts2face.models.palette_file import load_palette
from tts2face.models.talker import Talker
from tts2face.session.animated_face import mesh_face
from tts2face.types import Trajectory

FPS = 60.0
CLOSED_MM, PAUSE_MM = 0.1, 0.15
# Bilabials after and before every kind of lip shape, short ones, pairs, beside labiodentals, first and last in a clip.
TEXTS = (
    "m aɪ m ʌ ð ɚ m eɪ m u v f aɪ v b ɪ ɡ m æ p s",
    "b ɑ b sil p ʌ m p sil m u m",
    "æ b ɑ m b ʃ u p w i m w u b f m v p ɔ m",
)
DURATIONS_S = (0.03, 0.07, 0.12)


def sequence(words: str, phone_s: float) -> PhoneSequence:
    """Phones of equal duration between two pauses of 0.4 s; a bilabial lasts half as long as other phones."""
    labels = [SILENCE, *words.split(), SILENCE]
    spans = [0.4 if label == SILENCE else phone_s * (0.5 if label in "pbm" else 1.0) for label in labels]
    return PhoneSequence(labels, np.concatenate([[0.0], np.cumsum(spans)]))


def speak(
    face: Face, models: tuple[Talker, ExemplarModel], phones: PhoneSequence, factor: float, fps: float
) -> Trajectory:
    animated = mesh_face(*models, face)
    selection = select_tokens(phones, models[1], SynthesisOptions(articulation=factor))
    return animated.motion_of_tokens(selection, fps=fps, n_frames=int(phones.end * fps))


def gaps_of(face: Face, weights: NDArray[np.float32]) -> NDArray[np.float64]:
    """Gaps (T, P) of all pairs of inner lip points, mm."""
    rest = scatter_landmarks(face, landmark_positions(face))
    motion = scatter_landmarks(face, landmark_motion(face, np.arange(len(face.shape_names))))
    return inner_lip_gaps(rest) + np.tensordot(weights, inner_lip_gaps(np.moveaxis(motion, 2, 0)), axes=(1, 0))


def middles(phones: PhoneSequence, fps: float) -> NDArray[np.int64]:
    """Frames at the middle of the bilabials."""
    bounds = zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True)
    return np.array([round((start + end) / 2 * fps) for label, start, end in bounds if label in "pbm"])


@pytest.mark.parametrize("factor", [0.5, 1.0, 1.5, 2.0])
@pytest.mark.parametrize("phone_s", DURATIONS_S)
def test_every_bilabial_closes_along_the_whole_line(
    phone_s: float, factor: float, talker: Talker, exemplars: ExemplarModel
) -> None:
    face = load_face("head", hair="bald")
    for fps, words in zip((25.0, 30.0, FPS), TEXTS, strict=True):
        phones = sequence(words, phone_s)
        gaps = gaps_of(face, speak(face, (talker, exemplars), phones, factor, fps).values)
        assert gaps[middles(phones, fps)].max() <= CLOSED_MM
        assert gaps[[0, -1]].max() <= PAUSE_MM
        pauses = [
            gaps[int((start + 0.13) * fps) : int((end - 0.21) * fps) + 1]
            for label, start, end in zip(phones.phones, phones.edges[:-1], phones.edges[1:], strict=True)
            if label == SILENCE
        ]
        assert max(pause.max(axis=1).min() for pause in pauses) <= PAUSE_MM


def test_expressions_keep_bilabials_closed(talker: Talker, exemplars: ExemplarModel) -> None:
    face = load_face("head", hair="bald")
    prepared = gesture_face(face, load_palette("starter"))
    phones = sequence(TEXTS[0], 0.07)
    speech = speak(face, (talker, exemplars), phones, 1.5, FPS)
    for name in EXPRESSIONS:
        values = np.zeros((len(speech), len(EXPRESSIONS)), np.float32)
        values[:, EXPRESSIONS.index(name)] = 0.8
        moved = prepared.perform(speech, {"expression": values}).motion.values
        assert gaps_of(prepared.face, moved)[middles(phones, FPS)].max() <= CLOSED_MM


def test_steps_of_weights_are_those_of_people(talker: Talker, exemplars: ExemplarModel) -> None:
    """The fastest score in recordings of people changes by .34 per 1/60 s (99.9th percentile)."""
    face = load_face("head", hair="bald")
    for words in TEXTS:
        phones = sequence(words, 0.1)
        for factor in (0.5, 1.0, 1.5):
            steps = np.abs(np.diff(speak(face, (talker, exemplars), phones, factor, FPS).values, axis=0))
            assert steps.max() <= 0.34


def test_limited_values_are_the_nearest_with_limited_slope() -> None:
    rng = np.random.default_rng(0)
    values = rng.uniform(0, 1, (40, 3))
    limited = limit_speed(values, FPS)
    largest = LARGEST_SPEED_PER_S / FPS
    assert np.abs(np.diff(limited, axis=0)).max() <= largest + 1e-12
    reach = largest * np.abs(np.subtract.outer(np.arange(40), np.arange(40)))
    above = (values[None] - reach[:, :, None]).max(axis=1)  # every pair of frames
    below = (values[None] + reach[:, :, None]).min(axis=1)
    np.testing.assert_allclose(limited, (above + below) / 2, atol=1e-12)
    slow = np.cumsum(rng.uniform(-largest, largest, (40, 3)), axis=0)
    np.testing.assert_allclose(limit_speed(slow, FPS), slow, atol=1e-12)


def test_closed_spans_hold_a_frame_at_any_rate() -> None:
    phones = sequence("ɑ b ɑ m p ɑ", 0.04)
    for fps in (12.0, 25.0, 60.0):
        times = np.arange(int(phones.end * fps)) / fps
        assert seconds_from_closure(phones, times)[middles(phones, fps)].max() < 1e-9
    fine = np.arange(0, phones.end, 0.001)
    assert (seconds_from_closure(phones, fine) == 0).sum() >= 1000 * (2 * MIN_CLOSURE_S + 0.01)  # two overlap
    assert np.isinf(seconds_from_closure(sequence("ɑ i", 0.1), fine)).all()


def test_lips_part_no_faster_than_people_and_far_frames_are_unchanged(talker: Talker) -> None:
    face = load_face("head", hair="bald")
    mouth = build_lip_constraints(face).with_change_cost()
    speech = np.zeros((5, len(face.shape_names)))
    speech[:, face.shape_names.index("jawOpen")] = 0.3
    bounds = largest_gaps(np.array([0.0, 0.01, 0.02, 0.2, np.inf]), 1.0)
    np.testing.assert_allclose(bounds[:3], [0.0, 1.5, 4.0])
    rest = np.zeros(len(mouth.gaps))
    closed = close_lips(mouth, speech, rest, bounds, np.zeros(5))
    widest = (closed @ mouth.gaps.T).max(axis=1)
    assert widest[0] <= 0.02
    assert (widest[1:3] <= bounds[1:3] + 0.05).all()
    np.testing.assert_allclose(closed[3:], speech[3:], atol=1e-3)
    pressed = close_lips(mouth, speech, rest + 0.5, bounds, np.zeros(5))
    assert (pressed[0] @ mouth.gaps.T)[1:-1].max() <= -0.45  # a gap at rest is closed as well
