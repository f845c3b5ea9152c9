"""Plans: outputs, segments, content addresses, cast."""

import shutil
import time
import wave
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.serving.batch.conftest import SRT, Planner
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.serving.batch import file_plan
from tts2face.serving.batch.cast import read_cast
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.segment import segment_from_json
from tts2face.storage.shipped import SHIPPED_FOLDER

CAST = """
[default]
identity = "kofi"

[[role]]
speaker = "ann*"
face = "ada"
voice = "espeak-female"
style = "delighted"
rate = 1.1
"""


def test_a_clip_for_each_spoken_cue(plan_of: Planner) -> None:
    plan = plan_of(SRT + "\n4\n00:00:12,000 --> 00:00:13,000\n[silence]\n")
    assert [output.name for output in plan.outputs] == ["one-0001.mp4", "one-0002.mp4", "one-0003.mp4"]
    assert [one.segments[0].window_frames for one in plan.outputs] == [16, 16, 16]  # one in which the lips open
    assert (plan.n_cues, plan.n_silent) == (4, 1)
    assert [cue.speaker for output in plan.outputs for cue in output.cues] == ["ANN", "", ""]


def test_speakers_of_one_cue_have_their_own_clips_and_divide_its_time(plan_of: Planner, tmp_path: Path) -> None:
    (tmp_path / "cast.toml").write_text(CAST)
    text = "1\n00:00:01,000 --> 00:00:04,000\n- JOHN: Good.\n- ANN: Hello there.\n"
    plan = plan_of(text, cast=read_cast(tmp_path / "cast.toml"))
    assert [(one.name, one.begin_s) for one in plan.outputs] == [("one-0001.mp4", 0.9), ("one-0001-2.mp4", 1.9)]
    assert [one.segments[0].models.face for one in plan.outputs] == ["head", "ada"]
    assert [cue.speaker for one in plan.outputs for cue in one.cues] == ["JOHN", "ANN"]
    assert [(one.line, one.message) for one in plan.warnings] == [
        (2, "JOHN and ANN speak in cue 1; its time is divided by their letters"),
        (0, "no role applies to JOHN (1 line); they have the default face and voice"),
    ]
    (file,) = plan_of(text, per="file").outputs
    assert [(cue.begin_s, cue.end_s) for cue in file.cues] == [(1.0, 1.9), (1.9, 4.0)]


def test_a_recording_of_two_speakers_shows_one_face(plan_of: Planner, tmp_path: Path) -> None:
    (tmp_path / "dub").mkdir()
    (tmp_path / "dub" / "one-0001.wav").write_bytes(b"RIFF")
    plan = plan_of("1\n00:00:01,000 --> 00:00:04,000\n- JOHN: Good.\n- Hello.\n", audio=tmp_path / "dub")
    assert len(plan.outputs) == 1
    assert [one.message for one in plan.warnings] == [
        "JOHN and somebody speak in cue 1, which has one recording; one face is shown"
    ]


def test_scenes_files_and_films_fill_all_frames(plan_of: Planner) -> None:
    scenes = plan_of(per="scene").outputs
    assert [(one.name, one.begin_s) for one in scenes] == [("one-scene-001.mp4", 0.4), ("one-scene-002.mp4", 9.9)]
    (file,) = plan_of(per="file").outputs
    assert sum(one.slot_frames or 0 for one in file.segments) == 125  # the last cue ends at 11.5 s, and 1 s more
    assert [cue.begin_s for cue in file.cues] == [0.5, 2.5, 10.0]
    (film,) = plan_of(per="film").outputs
    assert film.name == "film.mp4"
    assert [one.address for one in film.segments] == [one.address for one in file.segments]


def test_a_line_before_a_long_silence_may_use_all_of_it(plan_of: Planner) -> None:
    text = "1\n00:00:20,000 --> 00:00:20,300\nThe word hello means hello to everybody in this large house.\n\n2\n"
    slots = []
    for begin in ("22,300", "22,400", "22,600", "23,100", "26,000", "40,000"):
        plan = plan_of(f"{text}00:00:{begin} --> 00:00:41,000\nHe came home.\n", per="file")
        segment = plan.lines[0].segment
        slots.append(segment.slot_frames)
        assert segment.silence_s == (0.3 if segment.slot_frames < 61 and begin > "26" else 0.0)
    assert slots == sorted(slots)
    assert slots[2] == 26  # up to the frame at which the lips of the next line open


def test_a_film_continues_with_the_next_file(tmp_path: Path) -> None:
    for name in ("a.srt", "b.srt"):
        (tmp_path / name).write_text(SRT, encoding="utf-8")
    plan = plan_batch([tmp_path / "a.srt", tmp_path / "b.srt"], BatchOptions(per="film"), request=Request(fps=10))
    (film,) = plan.outputs
    assert [cue.begin_s for cue in film.cues] == [0.5, 2.5, 10.0, 13.0, 15.0, 22.5]
    assert len(plan.segments) == len(film.segments) / 2  # equal segments occur once


def test_an_address_depends_on_everything_that_changes_the_clip(plan_of: Planner, tmp_path: Path) -> None:
    first = plan_of().outputs
    changed = plan_of(SRT.replace("Bob", "Tom")).outputs
    assert [a.address == b.address for a, b in zip(first, changed, strict=True)] == [True, True, False]
    path = tmp_path / "one.srt"
    path.write_text(SRT, encoding="utf-8")
    addresses = {
        plan_batch([path], BatchOptions(**options), request=Request(fps=10, **request), picture=Picture(size=size))
        .outputs[0]
        .address
        for options, request, size in (
            ({}, {}, "64x64"),
            ({}, {}, "128x64"),
            ({"overflow": "report"}, {}, "64x64"),
            ({"max_rate": 1.2}, {}, "64x64"),
            ({}, {"style": "delighted"}, "64x64"),
            ({}, {"voice": "espeak"}, "64x64"),
            ({}, {"seed": 1}, "64x64"),
        )
    }
    assert len(addresses) == 7


def test_a_model_counts_by_its_content_and_not_by_its_path(plan_of: Planner, tmp_path: Path) -> None:
    role = '[[role]]\nspeaker = "*"\npalette = "{}"\n'
    (tmp_path / "cast.toml").write_text(role.format("mine.palette"))
    palette = tmp_path / "mine.palette"
    shutil.copy(SHIPPED_FOLDER / "starter.palette", palette)
    same = plan_of(cast=read_cast(tmp_path / "cast.toml")).outputs[0].address
    assert same == plan_of().outputs[0].address
    palette.write_bytes(palette.read_bytes() + b"x")
    assert plan_of(cast=read_cast(tmp_path / "cast.toml")).outputs[0].address != same


def test_segments_survive_json(plan_of: Planner) -> None:
    for segment in plan_of(per="file").segments.values():
        assert segment_from_json(segment.as_json()).address == segment.address


def test_roles_choose_models_and_options(plan_of: Planner, tmp_path: Path) -> None:
    (tmp_path / "cast.toml").write_text(CAST)
    first, second, _ = (one.segments[0] for one in plan_of(cast=read_cast(tmp_path / "cast.toml")).outputs)
    assert (first.models.face, first.models.identity) == ("ada", None)  # presets belong to a face
    assert {name: first.request[name] for name in ("voice", "style", "rate")} == {
        "voice": "espeak-female",
        "style": "delighted",
        "rate": 1.1,
    }
    assert (second.models.face, second.models.identity) == ("head", "kofi")
    assert "voice" not in second.request


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("x = 1", "there is no table 'x'"),
        ("[default]\nhat = 1", "there is no setting 'hat'"),
        ("[[role]]\nface = 'head'", "role 1 has no pattern"),
        ("[[role]]\nspeaker = 3", "speaker must be a text"),
        ("[default]\nrate = 9.0", "rate must lie between"),
        ("[default]\nlanguage = 'xx'", "language"),
        ("[default]\nface = 3", "face must be a text"),
        ("[default]\nrate = 1" + "0" * 400, "rate is too large a number; the maximum is"),
        ("[default]\nstyle = 7", "style must be a text in quotes, not 7"),
        ("[default]\npitch = 1979-05-27", 'pitch must be true or false, not "1979-05-27"'),
        ("[default", "is not TOML"),
        ("role = 3", r"write the defaults as \[default\]"),
    ],
)
def test_wrong_casts_are_refused(content: str, reason: str, tmp_path: Path) -> None:
    (tmp_path / "cast.toml").write_text(content)
    with pytest.raises(DataError, match=reason):
        read_cast(tmp_path / "cast.toml")


def test_words_of_another_writing_system_are_spoken(plan_of: Planner) -> None:
    plan = plan_of(SRT.replace("Bob may move.", "☃ … 你好"))
    assert (len(plan.outputs), plan.n_silent, plan.warnings) == (3, 0, ())


def test_a_cue_that_is_refused_is_a_warning_with_its_line(plan_of: Planner, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(request: Request) -> None:
        if "Bob" in request.text:
            raise InputError("no")

    monkeypatch.setattr(file_plan, "prepare", refuse)
    plan = plan_of(SRT)
    assert [(one.line, one.message[:15]) for one in plan.warnings] == [(10, "cue 3 is silent")]
    assert (len(plan.outputs), plan.n_silent) == (2, 1)


@pytest.mark.parametrize(
    ("setting", "reason"),
    [
        ('face = "haed"', "there is no face 'haed'"),
        ('talker = "grid"', "there is no talker 'grid'"),
        ('identity = "adda"', "the face head has no identity 'adda'; it has erik"),
        ('style = "gleeful"', "there is no style 'gleeful' in the palette"),
        ('face = "self"\narticulation = "clear"', "a talker's own face articulates as recorded; remove articulation"),
        ('voice = "nosuch"', "there is no voice 'nosuch'; give heart"),
        ('voice = "/no/such.onnx"', "cannot read /no/such.onnx: No such file"),
    ],
)
def test_names_of_a_cast_are_checked_before_anything_is_rendered(
    setting: str, reason: str, plan_of: Planner, tmp_path: Path
) -> None:
    (tmp_path / "cast.toml").write_text(f'[[role]]\nspeaker = "ANN"\n{setting}\n')
    with pytest.raises(InputError, match=reason):
        plan_of(cast=read_cast(tmp_path / "cast.toml"))


def test_a_role_that_applies_to_no_cue_is_a_warning(plan_of: Planner, tmp_path: Path) -> None:
    (tmp_path / "cast.toml").write_text('[[role]]\nspeaker = "ANN"\n[[role]]\nspeaker = "JOHNN"\nface = "ada"\n')
    plan = plan_of(cast=read_cast(tmp_path / "cast.toml"))
    assert [(one.file, one.line, one.message) for one in plan.warnings] == [
        ("the cast", 0, "role 2 (speaker 'JOHNN') applies to no cue; check its patterns"),
        ("the cast", 0, "no role applies to (no name) (2 lines); they have the default face and voice"),
    ]


def test_cues_that_cannot_be_spoken_count_as_silent(plan_of: Planner) -> None:
    assert plan_of(SRT.replace("Bob may move.", "☃ …")).n_silent == 1


def test_a_language_of_the_file_is_used_and_an_unknown_one_is_not(plan_of: Planner) -> None:
    vtt = "WEBVTT\n\n00:01.000 --> 00:02.000\n<lang de>Guten Tag.</lang>\n\n00:03.000 --> 00:04.000\n<lang xx>Hello.\n"
    plan = plan_of(vtt, name="one.vtt")
    assert [one.segments[0].request.get("language") for one in plan.outputs] == ["de", None]
    assert ["language xx" in one.message for one in plan.warnings] == [True]


def test_files_of_one_name_get_their_folders_names(tmp_path: Path) -> None:
    for folder in ("s1", "s2"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "a.srt").write_text(SRT, encoding="utf-8")
    files = [tmp_path / folder / "a.srt" for folder in ("s1", "s2")]
    assert [one.name for one in plan_batch(files, BatchOptions(per="file")).outputs] == ["s1-a.mp4", "s2-a.mp4"]
    with pytest.raises(InputError, match="given twice"):
        plan_batch([files[0], files[0]], BatchOptions())


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"per": "word"}, "--per must be"),
        ({"overflow": "shout"}, "--overflow must be"),
        ({"max_rate": 3.0}, "--max-rate must lie"),
        ({"scene_gap": 0.0}, "--scene-gap must lie"),
        ({"audio": Path("nowhere")}, "no folder of recordings"),
    ],
)
def test_wrong_options_are_refused(options: dict[str, object], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        BatchOptions(**options)


def test_a_transparent_background_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.srt").write_text(SRT, encoding="utf-8")
    with pytest.raises(InputError, match="no transparency"):
        plan_batch([tmp_path / "a.srt"], BatchOptions(), picture=Picture(background="transparent"))


def test_a_thousand_cues_are_planned_in_seconds(plan_of: Planner) -> None:
    lines = [
        f"{n}\n{n * 4 // 3600:02d}:{n * 4 // 60 % 60:02d}:{n * 4 % 60:02d},000 --> "
        f"{n * 4 // 3600:02d}:{n * 4 // 60 % 60:02d}:{n * 4 % 60:02d},900\nThis is cue {n}, no more.\n"
        for n in range(1000)
    ]
    began = time.perf_counter()
    plan = plan_of("\n".join(lines))
    assert len(plan.segments) == 1000
    assert time.perf_counter() - began < 10.0  # s on a busy machine; below 5 on an idle one


def test_cues_after_the_end_of_a_dubbing_track_are_left_out(plan_of: Planner, tmp_path: Path) -> None:
    (tmp_path / "dub").mkdir()
    with wave.open(str(tmp_path / "dub" / "one.wav"), "wb") as track:
        track.setparams((1, 2, 8000, 0, "NONE", ""))
        track.writeframes(bytes(2 * 8000 * 5))
    plan = plan_of(audio=tmp_path / "dub")
    assert [line.number for line in plan.lines] == [1, 2]
    assert "this cue begins after the end of the film, which has 5.0 s; it is left out" in [
        warning.message for warning in plan.warnings
    ]
    with pytest.raises(DataError, match="3 of 3 cues begin after the end of the film"):
        plan_of(audio=tmp_path / "dub", shift=100.0)
    assert [line.number for line in plan_of(audio=tmp_path / "dub", shift=-6.0).lines] == [1]


def test_what_is_guessed_of_a_recording_of_all_cues_is_a_note(plan_of: Planner, tmp_path: Path) -> None:
    (tmp_path / "dub").mkdir()
    tone = 0.3 * np.sin(0.2 * np.arange(12 * 8000))
    with wave.open(str(tmp_path / "dub" / "one.wav"), "wb") as track:
        track.setparams((2, 2, 8000, 0, "NONE", ""))
        track.writeframes((32767 * np.stack([tone, -tone], 1)).astype("<i2").tobytes())
    (note,) = [note for note in plan_of(audio=tmp_path / "dub").notes if note.file.endswith(".wav")]
    assert (note.file, note.line) == (str(tmp_path / "dub" / "one.wav"), 0)
    assert note.message.startswith("the 2 channels of one.wav cancel each other")


def test_frames_of_subtitles_have_the_rate_that_is_given(plan_of: Planner) -> None:
    content = "{50}{100}Hello there.\n{150}{200}Good bye.\n"
    plan = plan_of(content, name="one.sub", subtitle_fps=50.0)
    assert [(line.begin_s, line.end_s) for line in plan.lines] == [(1.0, 2.0), (3.0, 4.0)]
    assert not plan.warnings
    assert "--subtitle-fps" in plan_of(content, name="one.sub").warnings[0].message
