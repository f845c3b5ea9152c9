"""Exports from the session and from the command line: beside a video, alone, from a track, and of a performance."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

import tts2face
from cli.main import run
from lexicon.errors import DataError, InputError
from tests.world import World
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.interchange.exports.table import FORMATS
from tts2face.models.face import Face
from tts2face.session.session import Session
from tts2face.types import Clip
from tts2face.video.livelink import read_livelink

SMALL = {"size": "64x64", "fps": 5}
OWN = [f"all{one.suffixes[0]}" for one in FORMATS if one.package is None]
OF_EXTRAS = ["all.track.json", "all.wav", *(f"all{one.suffixes[0]}" for one in FORMATS if one.package)]
OF_ANY_EXTRA = pytest.mark.needs(*{one.package for one in FORMATS if one.package})


def assert_same_motion(one: Clip, other: Clip) -> None:
    assert one.motion.values.tobytes() == other.motion.values.tobytes()
    assert one.head.values.tobytes() == other.head.values.tobytes()
    assert one.speech.waveform.samples.tobytes() == other.speech.waveform.samples.tobytes()


@pytest.mark.parametrize("names", [OWN, pytest.param(OF_EXTRAS, marks=OF_ANY_EXTRA)], ids=["own", "of extras"])
def test_a_session_writes_all_formats_beside_a_video(session: Session, here: Path, names: list[str]) -> None:
    written = session.write("Hello there. Good bye.", here / "all.mp4", exports=names, **SMALL)
    textures = {path.name for path in written.exports} - set(names)
    assert all(name.startswith("all.usda.") for name in textures)
    assert len(written.exports) == len(names) + len(textures) == len({*written.exports})
    assert all((here / name).stat().st_size for name in [*names, "all.mp4"])
    clip = session.clip("Hello there. Good bye.", fps=5)
    assert_same_motion(tts2face.load_clip(here / "all.track.json"), clip)


def test_an_export_without_a_video_holds_the_same_clip(session: Session, here: Path) -> None:
    pieces: list[tts2face.Piece] = []
    steps: list[tuple[int, int]] = []
    written = session.export(
        "Hello. Good bye.", "a.json", fps=5, on_piece=pieces.append, on_progress=lambda *step: steps.append(step)
    )
    assert (written.path, written.exports) == (Path("a.json"), (Path("a.json"),))
    assert len(pieces) == 2
    assert steps[-1] == (16, 16)
    assert steps == sorted(steps)
    assert_same_motion(tts2face.load_clip("a.json"), session.clip("Hello. Good bye.", fps=5))


@pytest.mark.parametrize(
    ("paths", "options", "reason"),
    [
        ([], {}, "there is no output"),
        (["a.fbx"], {}, "no suffix of an export format"),
        (["a.vtt", "a.vtt"], {}, "the same path"),
        (["words.srt"], {"dictionary": "words.srt"}, "would replace dictionary"),
        (["speech.glb"], {"audio": "speech.wav"}, "speech.wav would replace audio"),
    ],
)
def test_wrong_paths_are_refused(
    paths: list[str], options: dict[str, str], reason: str, session: Session, here: Path
) -> None:
    (here / "words.srt").write_text("gif  JH IH1 F\n")
    (here / "speech.wav").write_bytes(b"RIFF")
    with pytest.raises(InputError, match=reason):
        session.export("Hello.", paths, **options)
    assert (here / "words.srt").read_text() == "gif  JH IH1 F\n"


def test_a_talker_s_own_face_has_no_mesh_to_export(session: Session, here: Path) -> None:
    class OwnFace:
        @property
        def mesh(self) -> Face:
            raise InputError("a talker's own face has no mesh; choose --face ada, head or a .face file")

    clip = session.clip("", idle=0.2, fps=5, gestures="none")
    with pytest.raises(InputError, match="own face has no mesh"):
        tts2face.export(clip, "a.glb", face=OwnFace())  # type: ignore[arg-type]
    tts2face.export(clip, "a.bvh", face=OwnFace())  # type: ignore[arg-type]


def test_commands_write_export_and_convert(tones: World, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["Hello there.", "--fps", "5", "--out", "a.track.json", "--export", "a.csv", "--export", "vtt:a.txt"]
    shown = ["--face", str(tones.face_file), "--palette", str(tones.palette_file)]
    assert run([*words, *tones.flags]) == 0, capsys.readouterr().err
    assert "wrote a.track.json, a.csv, a.txt: " in capsys.readouterr().err
    assert (here / "a.txt").read_text().startswith("WEBVTT")
    assert run(["convert", "a.track.json", "b.csv", "b.glb", "b.txt", "--quiet"]) == 2  # .txt is no format
    assert run(["convert", "a.track.json", "b.csv", "b.glb", "vtt:b.txt", *shown]) == 0, capsys.readouterr().err
    assert "wrote b.csv, b.glb, b.txt, b.wav in " in capsys.readouterr().err
    assert (here / "b.csv").read_bytes() == (here / "a.csv").read_bytes()
    assert (here / "b.txt").read_bytes() == (here / "a.txt").read_bytes()
    assert run(["convert", "a.track.json", "c.csv", "--fps", "24", "--quiet", *shown]) == 0
    read = read_livelink(here / "c.csv").weights
    assert read.fps == 24.0
    assert set(read.channels) == set(ARKIT_SHAPES)


def test_a_capture_is_exported_as_it_was_recorded(here: Path) -> None:
    chance = np.random.default_rng(0)
    rows = ["Timecode,BlendshapeCount," + ",".join(name[0].upper() + name[1:] for name in ARKIT_SHAPES)]
    weights = chance.uniform(0.0, 1.0, (60, 52)).round(6)
    rows += [f"00:00:{at // 30:02d}:{at % 30:02d},61," + ",".join(map(str, row)) for at, row in enumerate(weights)]
    (here / "take.csv").write_text("\n".join(rows))
    assert run(["mimic", "take.csv", "--out", "a.csv", "--export", "a.a2f.json", "--quiet"]) == 0
    matrix = np.array(json.loads((here / "a.a2f.json").read_text())["weightMat"])
    assert np.allclose(matrix, weights, rtol=1e-5, atol=1e-6)
    assert np.allclose(read_livelink(here / "a.csv").weights.values[::2], weights, rtol=0, atol=2e-6)
    assert run(["mimic", "a.a2f.json", "--out", "b.curves.jsonl", "--export", "b.a2f.json", "--quiet"]) == 0
    assert np.allclose(json.loads((here / "b.a2f.json").read_text())["weightMat"], matrix, rtol=0, atol=1e-5)
    assert run(["mimic", "b.curves.jsonl", "--out", "c.curves.jsonl", "--quiet"]) == 0
    assert (here / "c.curves.jsonl").read_text() == (here / "b.curves.jsonl").read_text()


@pytest.mark.parametrize(
    ("name", "content", "code", "reason"),
    [
        ("a.track.json", '{"format": "tts2face-track"}', 3, "a.track.json is a track, which is exact"),
        ("a.json", '{"mouthCues": []}', 3, "a.json holds no weights of shapes: JSON of Audio2Face has exportFps"),
        ("a.words.jsonl", '{"start": 0, "end": 1, "word": "a"}', 3, "holds no weights of shapes: the first line"),
        ("a.a2f.json", '{"exportFps": 30, "facsNames": ["jawOpen"], "weightMat": [[1], []]}', 3, "frame 1 of a.a2f"),
        ("a.curves.jsonl", '{"fps": 0, "weights": ["jawOpen"]}', 3, "has 0 frames per second"),
        ("a.bvh", "HIERARCHY", 2, "a.bvh has the suffix of the export bvh, which mimic does not read; give a video"),
        ("a.glb", "glTF", 2, "a.glb has the suffix of the export glb, which mimic does not read"),
    ],
)
def test_what_mimic_does_not_read_is_refused_for_what_it_is(
    name: str, content: str, code: int, reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / name).write_text(content)
    assert run(["mimic", name, "--out", "x.csv", "--quiet"]) == code
    assert reason in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "code", "reason"),
    [
        (["Hi.", "--export", "a.jsonl"], 2, "a.jsonl may have several formats"),
        (["Hi.", "--export", "a.fbx", "--out", "a.mp4"], 2, "a.fbx has no suffix of an export format"),
        (["Hi.", "--export", "no/a.glb"], 2, "there is no folder no"),
        (["Hi.", "--out", "a.glb", "--export", "a.glb"], 2, "--out and --export a.glb are the same file a.glb"),
        (["--file", "text.srt", "--export", "text.srt"], 2, "--export text.srt text.srt would replace --file"),
        (["Hi.", "--out", "a.xyz"], 2, "a.xyz has the unknown suffix .xyz"),
        (["mimic", "take.csv", "--export", "take.csv"], 2, "would replace the take"),
        (
            ["mimic", "--camera", "0", "--export", "a.csv"],
            2,
            "--camera cannot be combined with",
        ),
        (["mimic", "take.csv"], 2, "there is no input or no output"),
        (["convert", "no.json", "a.csv"], 2, "there is no track no.json"),
        (["convert", "text.srt", "text.srt"], 2, "would replace the track"),
        (["convert", "text.srt", "a.csv"], 3, "text.srt, line 2: not JSON"),
        (["convert", "text.srt", "a.vtt", "--fps", "9"], 2, "a.vtt has no frames, so fps has no effect"),
    ],
)
def test_wrong_commands_are_refused_before_work(
    words: list[str], code: int, reason: str, here: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (here / "text.srt").write_text("1\n00:00:01,000 --> 00:00:02,000\nHello.\n")
    (here / "take.csv").write_text("Timecode,JawOpen")
    before = {path: path.read_bytes() for path in here.iterdir()}
    assert run(words) == code
    message = capsys.readouterr().err
    assert re.search(reason, message), message
    assert len(message.strip().splitlines()) == 1
    assert {path: path.read_bytes() for path in here.iterdir()} == before


def test_a_track_of_another_face_is_refused(session: Session, here: Path) -> None:
    clip = session.clip("", idle=0.2, fps=5)
    names = ("a", *clip.motion.channels[1:])
    other = tts2face.Clip(tts2face.Trajectory(names, clip.motion.values, 5.0), clip.head, clip.speech)
    tts2face.export(other, "a.json")
    with pytest.raises(
        DataError, match=r"\d+ channels .* which are not those of the face ada with the palette starter"
    ):
        tts2face.convert("a.json", "a.glb")
    tts2face.convert("a.json", "a.bvh")
