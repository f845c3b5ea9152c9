"""A real clip from text to file, decoded again and looked at."""

from pathlib import Path

import av
import numpy as np
import pytest
import soxr

from lexicon.sequence import SILENCE
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.session.session import Session
from tts2face.types import Clip

TEXT = "Bob may move five big maps, but we were away."
SIDE = 256
MOUTH = slice(SIDE * 55 // 100, SIDE * 75 // 100), slice(SIDE * 38 // 100, SIDE * 62 // 100)
TOUCHING_MM = 0.6  # a third of a pixel at 512 px


@pytest.fixture(scope="module")
def ready(shipped: Session) -> Session:
    return shipped


@pytest.fixture(scope="module")
def made(ready: Session, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Clip]:
    path = tmp_path_factory.mktemp("clip") / "clip.mp4"
    clips: list[Clip] = []
    ready.write(f"{TEXT}[pause 0.3]", path, size=f"{SIDE}x{SIDE}", on_piece=lambda piece: clips.append(piece.clip))
    (clip,) = clips
    return path, clip


@pytest.fixture(scope="module")
def pictures(made: tuple[Path, Clip]) -> np.ndarray:
    with av.open(str(made[0])) as container:
        return np.stack([frame.to_ndarray(format="rgb24") for frame in container.decode(video=0)])


@pytest.fixture(scope="module")
def sound(made: tuple[Path, Clip]) -> tuple[np.ndarray, int]:
    with av.open(str(made[0])) as container:
        frames = list(container.decode(audio=0))
        return np.concatenate([frame.to_ndarray()[0] for frame in frames]), frames[0].sample_rate


def test_picture_and_sound_end_within_a_frame(made: tuple[Path, Clip], pictures: np.ndarray) -> None:
    path, clip = made
    assert len(pictures) == len(clip.motion)
    with av.open(str(path)) as container:
        video, audio = container.streams.video[0], container.streams.audio[0]
        assert video.codec_context.name == "h264"
        assert audio.codec_context.name == "aac"
        ends = [float(stream.duration * stream.time_base) for stream in (video, audio)]
    assert abs(ends[0] - ends[1]) <= 1 / 30 + 1e-3
    assert abs(ends[0] - clip.speech.waveform.duration) <= 1 / 30


def test_the_head_is_visible(pictures: np.ndarray) -> None:
    """Skin in the middle, redder than blue; the studio's background at the top corners, which never moves."""
    skin = pictures[:, SIDE // 2 - 10 : SIDE // 2 + 10, SIDE // 2 - 10 : SIDE // 2 + 10].mean(axis=(0, 1, 2))
    assert skin[0] > skin[2] + 20
    corner = pictures[:, :10, :10].astype(float)
    assert np.abs(corner - corner[0]).mean() < 2


def test_the_mouth_moves_in_speech_and_rests_in_silence(made: tuple[Path, Clip], pictures: np.ndarray) -> None:
    phones = made[1].speech.phones
    change = np.abs(np.diff(pictures[(slice(None), *MOUTH)].astype(float), axis=0)).mean(axis=(1, 2, 3))
    times = np.arange(1, len(pictures)) / 30
    labels = np.array([phones.phones[phones.index_at(t)] for t in times])
    spoken = [k for k, label in enumerate(phones.phones) if label != SILENCE]
    borders = np.array([edge for k in spoken for edge in phones.edges[k : k + 2]])
    still = change[(labels == SILENCE) & (np.abs(times[:, None] - borders).min(axis=1) > 0.2)]
    assert len(still) > 3
    assert change[labels != SILENCE].mean() > 2 * still.mean()  # a living head moves the mouth's place in silence, too


def test_lips_touch_at_bilabials_and_part_at_open_vowels(made: tuple[Path, Clip], ready: Session) -> None:
    """The gap of the inner lips on the mesh that is drawn, at the middle of the mouth, mm."""
    clip, face = made[1], ready.mesh
    assert face is not None
    rows = {int(number): row for row, number in enumerate(face.landmarks)}
    mixed = face.landmark_weights[..., None]

    def place(surface: np.ndarray, landmark: int) -> np.ndarray:
        return (surface[face.landmark_vertices[rows[landmark]]] * mixed[rows[landmark]]).sum(axis=0)

    def gap(weights: np.ndarray) -> float:
        surface = face.vertices + np.tensordot(weights, face.shapes, axes=1)
        middle = range(3, 8)
        return float(
            np.mean([place(surface, INNER_LIP_UPPER[k])[1] - place(surface, INNER_LIP_LOWER[k])[1] for k in middle])
        )

    at_rest = gap(np.zeros(len(face.shape_names), np.float32))
    phones = clip.speech.phones
    closed, opened = [], []
    for phone, start, end in zip(phones.phones, phones.edges, phones.edges[1:], strict=False):
        frames = range(int(start * 30), min(len(clip.motion), int(np.ceil(end * 30)) + 1))
        gaps = [gap(clip.motion.values[frame]) - at_rest for frame in frames]
        if phone in {"p", "b", "m"}:
            closed.append(min(gaps))
        elif phone in {"ɑ", "æ", "aɪ"}:
            opened.append(max(gaps))
    assert len(closed) >= 8
    assert np.mean(np.array(closed) < TOUCHING_MM) >= 0.85
    assert min(opened) > 2.0


def test_sound_is_in_step(made: tuple[Path, Clip], sound: tuple[np.ndarray, int]) -> None:
    """The decoded sound is the voice's, shifted by less than half a frame."""
    waveform = made[1].speech.waveform
    decoded, rate = sound
    spoken = soxr.resample(waveform.samples, waveform.rate, rate)
    n = min(len(decoded), len(spoken))
    spectrum = np.fft.rfft(decoded[:n], 2 * n) * np.conj(np.fft.rfft(spoken[:n], 2 * n))
    lag = int(np.argmax(np.fft.irfft(spectrum)))
    lag = lag - 2 * n if lag > n else lag
    assert abs(lag) / rate < 0.5 / 30
