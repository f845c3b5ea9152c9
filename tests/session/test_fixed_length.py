"""Clips of a given number of frames: from rest to rest, with idle animation after the speech."""

import numpy as np
import pytest

import tts2face
from tests.tones import LEAD_S, PHONE_S, TRAIL_S, LetterVoice
from tests.world import World
from tts2face.session.fixed_length import OPENING_S, ease_weights
from tts2face.sound import voice_pool
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import concatenate_clips

FPS = 10


@pytest.fixture
def ready(world: World, monkeypatch: pytest.MonkeyPatch) -> tts2face.Session:
    monkeypatch.setattr(voice_pool, "load_voice", lambda *_: LetterVoice())
    return world.session(voices=VoicePool())


def test_the_span_of_speech_is_measured_without_motion(ready: tts2face.Session) -> None:
    span = ready.measure_speech("Hello. Bob.", fps=FPS, lead=LEAD_S)
    first = LEAD_S + 5 * PHONE_S + TRAIL_S  # a whole number of frames
    assert span.begin == pytest.approx(LEAD_S)
    assert span.end == pytest.approx(first + LEAD_S + 3 * PHONE_S)
    assert span.total == pytest.approx(first + LEAD_S + 3 * PHONE_S + TRAIL_S)


@pytest.mark.parametrize("n_frames", [1, 2, 7, 10, 11, 40, 130])
def test_a_clip_has_the_frames_asked_for_and_rests_at_both_ends(n_frames: int, ready: tts2face.Session) -> None:
    clips = list(ready.stream_to_length("Hello.", n_frames, fps=FPS))
    assert sum(len(clip.motion) for clip in clips) == n_frames
    assert sum(len(clip.speech.waveform.samples) for clip in clips) == n_frames * 8000 // FPS
    for clip, frame in ((clips[0], 0), (clips[-1], -1)):
        assert not clip.motion.values[frame].any()
        assert not clip.head.values[frame].any()


@pytest.mark.parametrize(("lead", "weights"), [(0.1, [0.0, 0.16, 0.5, 0.84, 1.0]), (0.0, [0.0, 0.5, 1.0])])
def test_a_face_that_speaks_at_once_is_there_within_two_frames_of_its_first_sound(
    lead: float, weights: list[float]
) -> None:
    found = ease_weights(60, 30.0, lead + OPENING_S)
    assert found[: len(weights)] == pytest.approx(weights, abs=0.01)
    assert found[-1] == 0.0
    assert ease_weights(1, 30.0, lead)[0] == 0.0


def test_silence_after_the_speech_moves(ready: tts2face.Session) -> None:
    whole = concatenate_clips(list(ready.stream_to_length("Hello.", 60, fps=FPS)))
    assert np.abs(np.diff(whole.head.values[15:55], axis=0)).max() > 0.0
    assert not whole.speech.waveform.samples[8000 + 8000 // 2 :].any()


def test_speech_in_the_middle_is_that_of_the_clip(ready: tts2face.Session) -> None:
    long, plain = concatenate_clips(list(ready.stream_to_length("Hello.", 40, fps=FPS))), ready.clip("Hello.", fps=FPS)
    n_samples = len(plain.speech.waveform.samples) - 8000 // FPS
    difference = long.speech.waveform.samples[:n_samples] - plain.speech.waveform.samples[:n_samples]
    assert np.abs(difference).max() < 1e-6


def test_an_utterance_is_spoken_once_when_it_is_measured_first(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    voice = LetterVoice()
    monkeypatch.setattr(voice_pool, "load_voice", lambda *_: voice)
    ready = world.session(voices=VoicePool())
    ready.measure_speech("Hello. Bob.", fps=FPS)
    list(ready.stream_to_length("Hello. Bob.", 50, fps=FPS))
    assert len(voice.said) == 2
