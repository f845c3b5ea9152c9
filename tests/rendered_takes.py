"""Takes rendered by the project: videos of a speaking head, with sound, transcripts and word times.

They replace recordings of a person in tests that need a speaking face, but no figures about real people. The
folder has the layout of the GRID corpus: ``clips/NAME.mkv``, ``align/NAME.align`` and ``manifest.csv``; a name spells
its sentence in GRID's code, ``bbaf2n`` is "bin blue at F two now".
``python -m tests.rendered_takes`` makes them again in 54 s of CPU time: tests read those of the folder ``takes``, which
``tests/build/test_rendered_takes.py`` compares with new ones.
"""

import csv
import shutil
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import av
import numpy as np
import pytest

from tts2face.picture.film import write_clips
from tts2face.picture.options import Picture
from tts2face.session.session import Session
from tts2face.types import Clip, Waveform

TAKES = Path(__file__).with_name("takes")
NAMES = (
    *("bbaf2n", "bbaf3s", "bbaf5a", "lwiz8p", "prbg4a", "sgwo9s"),
    *("bgim1n", "lrat6p", "pwby7a", "sbwkzs", "lgbe2n", "srih5p"),
)
DIGITS = ("one", "two", "three", "four", "five", "six", "seven", "eight", "nine", "zero")
WORDS = (
    {"b": "bin", "l": "lay", "p": "place", "s": "set"},
    {"b": "blue", "g": "green", "r": "red", "w": "white"},
    {"a": "at", "b": "by", "i": "in", "w": "with"},
    {},
    dict(zip("123456789z", DIGITS, strict=True)),
    {"a": "again", "n": "now", "p": "please", "s": "soon"},
)
MOODS: tuple[dict[str, str], ...] = (
    {},
    {"expression": "happy=0.5", "gain": "head=1.7,brows=1.5"},
    {"expression": "surprised=0.15", "gain": "head=2.4,brows=2.2,cheeks=1.6"},
)
FPS = 25
SIZE = "208x248"  # pixels, as the real takes; the tracker finds the rendered head from 160 x 160 on
ROOM_NOISE = 0.001  # standard deviation, -60 dB; forced alignment is inaccurate next to digital silence
LEAD_S, TAIL_S = 0.6, 0.4  # silence before and after a sentence
ALIGN_RATE = 25_000  # of GRID's word times, per second
CAPTURE_FPS = 60
CAPTURE_NAME = "take"

ONLY_RENDERED = pytest.mark.parametrize("takes", ["rendered"], indirect=True, scope="session")
"""For tests whose claim is not about real people and whose cost counts: they run on rendered takes alone."""


def manifest_rows(folder: Path) -> list[dict[str, str]]:
    """Rows of a folder's manifest."""
    with (folder / "manifest.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def transcript(name: str) -> str:
    """Sentence of a GRID code, in lower case."""
    return " ".join(words.get(letter, letter) for words, letter in zip(WORDS, name, strict=True))


def render_takes(folder: Path) -> None:
    """Render a take of each sentence of `NAMES` by the default talker on the shipped head."""
    session = Session("grid_s1", "head")
    renderer = session.face.renderer(Picture(size=SIZE))
    rows = []
    for name in ("clips", "align"):
        (folder / name).mkdir(parents=True)
    for number, name in enumerate(NAMES):
        text = transcript(name)
        spoken = " ".join(word.upper() if len(word) == 1 else word for word in text.split())
        marked = f"[pause {LEAD_S}]{spoken}.[pause {TAIL_S}]"
        # Gestures of the same sound would be alike in every take: each take has a seed and a mood of its own. Head and
        # blinks are those of a person who is recorded.
        clip = session.clip(marked, fps=FPS, lead=None, seed=number, style="measured", **MOODS[number % 3])
        write_clips(folder / f"{name}.mp4", [in_a_room(clip, number)], renderer)
        _remux(folder / f"{name}.mp4", folder / "clips" / f"{name}.mkv")
        times = word_times(clip)
        _write_align(folder / "align" / f"{name}.align", text.split(), times, clip.speech.waveform.duration)
        rows.append((name, text, f"{times[0][0]:.2f}", f"{times[-1][1]:.2f}"))
    with (folder / "manifest.csv").open("w", encoding="utf-8", newline="") as file:
        csv.writer(file).writerows([("clip", "transcript", "speech_start_s", "speech_end_s"), *rows])


def copy_takes(takes: Path, clips: tuple[str, ...], folder: Path) -> Path:
    """Copy some of the takes to a folder in the layout of GRID."""
    (folder / "clips").mkdir(parents=True, exist_ok=True)
    for clip in clips:
        shutil.copy(takes / "clips" / f"{clip}.mkv", folder / "clips")
    lines = (takes / "manifest.csv").read_text().splitlines()
    wanted = [line for line in lines if line.startswith(("clip,", *clips))]
    (folder / "manifest.csv").write_text("\n".join(wanted) + "\n")
    return folder


def write_capture(folder: Path) -> None:
    """Write a Live Link Face capture of 52 ARKit weights and the head at 60 fps, and its sound, as a face speaks."""
    session = Session("grid_s1", "head")
    text = " [pause 1] ".join(f"{transcript(name)}." for name in NAMES[3:8])
    clip = session.clip(f"[pause 1] {text} [pause 1]", fps=CAPTURE_FPS, style="measured")
    mesh_names = Session("grid_s1", "head", palette=None).mesh.shape_names
    columns = [clip.motion.channels.index(name) for name in mesh_names]
    turns = clip.head.values[:, :3] * (1, -1, 1)  # pitch, yaw, roll with the signs of Live Link
    values = np.column_stack([clip.motion.values[:, columns], turns])
    names = [*(name[0].upper() + name[1:] for name in mesh_names), "HeadPitch", "HeadYaw", "HeadRoll"]
    with (folder / f"{CAPTURE_NAME}.csv").open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["Timecode", "BlendshapeCount", *names])
        for number, row in enumerate(values):
            second, frame = divmod(number, CAPTURE_FPS)
            stamp = f"10:00:{second:02d}:{frame:02d}.000"
            rows.writerow([stamp, len(names), *(f"{value:.6f}" for value in row)])
    sound = in_a_room(clip, 0).speech.waveform
    write_sound(folder / f"{CAPTURE_NAME}.flac", sound.samples, sound.rate)


def in_a_room(clip: Clip, seed: int) -> Clip:
    """The clip with faint noise on its sound, as every recording has."""
    sound = clip.speech.waveform
    noise = np.random.default_rng(seed).normal(0, ROOM_NOISE, len(sound.samples))
    noisy = Waveform(np.clip(sound.samples + noise, -1, 1).astype(np.float32), sound.rate)
    return replace(clip, speech=replace(clip.speech, waveform=noisy))


def word_times(clip: Clip) -> list[tuple[float, float]]:
    """Begin and end of each word, in seconds."""
    edges = clip.speech.phones.edges
    return [(float(edges[word.first]), float(edges[word.last])) for word in clip.speech.words]


def write_sound(path: Path, samples: np.ndarray, rate: int) -> None:
    """Write samples (n,) in [-1, 1] as FLAC."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("flac", rate=rate, layout="mono")
        for at in range(0, len(samples), 4096):
            block = np.round(samples[at : at + 4096] * 32767).astype(np.int16)[None]
            frame = av.AudioFrame.from_ndarray(block, format="s16", layout="mono")
            frame.sample_rate, frame.pts = rate, at
            container.mux(stream.encode(frame))
        container.mux(stream.encode(None))


def _remux(source: Path, target: Path) -> None:
    with av.open(str(source)) as incoming, av.open(str(target), "w") as outgoing:
        copies = {
            stream.index: outgoing.add_stream_from_template(stream)
            for stream in incoming.streams
            if stream.type in {"video", "audio"}
        }
        for packet in incoming.demux():
            if packet.dts is not None and packet.stream.index in copies:
                packet.stream = copies[packet.stream.index]
                outgoing.mux(packet)
    source.unlink()


def _write_align(path: Path, words: list[str], times: list[tuple[float, float]], duration: float) -> None:
    path.write_text("".join(_align_lines(words, times, duration)), encoding="utf-8")


def _align_lines(words: list[str], times: list[tuple[float, float]], duration: float) -> Iterator[str]:
    starts = [begin for begin, _ in times]
    edges = [0.0, *starts, times[-1][1], duration]
    for label, (begin, end) in zip(["sil", *words, "sil"], pairwise(edges), strict=True):
        yield f"{round(begin * ALIGN_RATE)} {round(end * ALIGN_RATE)} {label}\n"


def make_takes(folder: Path) -> None:
    """Render the takes and the capture into a folder."""
    render_takes(folder)
    write_capture(folder)


if __name__ == "__main__":
    shutil.rmtree(TAKES, ignore_errors=True)
    make_takes(TAKES)
