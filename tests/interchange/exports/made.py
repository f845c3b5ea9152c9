"""Small clips with known motion, head pose and labels, on a small face; made without a voice."""

import numpy as np
import pytest

from lexicon.sequence import PhoneSequence, WordSpan
from tests.picture.tiny_face import tiny_face
from tts2face.face.shape_transfer import append_shapes
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.types import HEAD_CHANNELS, Clip, Speech, Trajectory, Waveform, exact_rate, first_sample

RATE = 16_000
FACE = tiny_face(textured=True)
PHONES = ("sil", "p", "aɪ", "ʁ", "ts", "sil")
WORDS = (WordSpan("Größe", 1, 3), WordSpan('<a> & "b"', 3, 5))


def format_parameter(one):
    """Parameter of a test for a format; the test is skipped where the format's package is not installed."""
    return pytest.param(one, id=one.name, marks=[pytest.mark.needs(one.package)] if one.package else [])


def made_clip(n_frames=30, fps=30.0, channels=FACE.shape_names, first_frame=0, seed=0):
    """Clip of random weights in [0, 1], a nodding head, six phones and two words; ends on a frame."""
    chance = np.random.default_rng(seed)
    exact = exact_rate(fps)
    n_samples = first_sample(first_frame + n_frames, RATE, exact) - first_sample(first_frame, RATE, exact)
    samples = chance.uniform(-1, 1, n_samples).astype(np.float32)
    edges = n_samples / RATE * np.array([0.0, 0.1, 0.25, 0.5, 0.6, 0.8, 1.0])
    edges[-1] = n_samples / RATE
    motion = chance.uniform(0, 1, (n_frames, len(channels))).astype(np.float32)
    head = np.column_stack([chance.uniform(-0.3, 0.3, (n_frames, 3)), chance.uniform(-9, 9, (n_frames, 3))])
    return Clip(
        Trajectory(channels, motion, fps),
        Trajectory(HEAD_CHANNELS, head, fps),
        Speech(Waveform(samples, RATE), PhoneSequence(PHONES, edges), WORDS),
    )


def silent_clip(n_frames=30, fps=30.0, channels=FACE.shape_names):
    """Clip without words, at rest."""
    clip = made_clip(n_frames, fps, channels)
    duration = clip.speech.waveform.duration
    speech = Speech(
        Waveform(np.zeros_like(clip.speech.waveform.samples), RATE), PhoneSequence(["sil"], [0.0, duration]), ()
    )
    rest = np.zeros_like(clip.motion.values)
    return Clip(Trajectory(channels, rest, fps), Trajectory(HEAD_CHANNELS, np.zeros((n_frames, 6)), fps), speech)


def turned_clip(n_frames=4, fps=30.0, *, channels=FACE.shape_names, **angles):
    """Clip at rest but for constant head channels: radians and millimetres."""
    clip = silent_clip(n_frames, fps, channels)
    head = np.zeros((n_frames, 6))
    for name, value in angles.items():
        head[:, HEAD_CHANNELS.index(name)] = value
    return Clip(clip.motion, Trajectory(HEAD_CHANNELS, head, fps), clip.speech)


def made_stream(n_pieces=3, n_frames=30, fps=30.0, channels=FACE.shape_names):
    """Consecutive clips, as a session gives them."""
    return [made_clip(n_frames, fps, channels, number * n_frames, seed=number) for number in range(n_pieces)]


def arkit_clip(n_frames=120, fps=60.0):
    """Clip with the 52 ARKit channels."""
    return made_clip(n_frames, fps, ARKIT_SHAPES)


def with_gesture(face=FACE):
    """The face with a shape in millimetres whose limits are -9 and 9."""
    mode = np.zeros((1, *face.vertices.shape), np.float32)
    mode[0, :40, 2] = 0.5
    return append_shapes(face, ("brows0",), mode, np.array([[-9.0, 9.0]], np.float32))


def signed_clip(n_frames, face):
    """Clip in the channels of a face whose gestures have both signs."""
    clip = made_clip(n_frames, 30.0, face.shape_names)
    low, high = face.limits.T
    return Clip(Trajectory(face.shape_names, low + (high - low) * clip.motion.values, 30.0), clip.head, clip.speech)
