"""Who speaks: several speakers without names, speakers without a role, lines that are left out, and their list."""

from pathlib import Path

import pytest

from lexicon.errors import DataError
from tests.serving.batch.conftest import SRT, Planner
from tts2face.serving.batch.cast import read_cast
from tts2face.serving.batch.report import planned_speakers
from tts2face.serving.batch.speakers import other_face
from tts2face.session.named_models import Models
from tts2face.sound.voice_pool import find_voice

TWO = "1\n00:00:01,000 --> 00:00:04,000\n- Good morning. - Hello there.\n"
SIGNS = """[Events]
Format: Start, End, Style, Name, Text
Dialogue: 0:00:01.00,0:00:03.00,Default,,Hello there.
Dialogue: 0:00:01.50,0:00:03.50,Sign - Door,,Keep out.
Dialogue: 0:00:04.00,0:00:06.00,Default,,Subtitles by Somebody
Dialogue: 0:00:07.00,0:00:08.00,Default,,Good morning.
"""


def cast_of(tmp_path: Path, text: str) -> object:
    (tmp_path / "cast.toml").write_text(text)
    return read_cast(tmp_path / "cast.toml")


@pytest.mark.parametrize(
    "text",
    [
        TWO,
        TWO.replace(" - ", "\n- "),
        TWO.replace("- Good", "Good").replace(" - ", "\n- "),
        TWO.replace("- Good", "JOHN: Good").replace(" - ", "\nANN: "),
        "1\n00:00:01,000 --> 00:00:04,000\nGood morning.\n\n2\n00:00:01,000 --> 00:00:04,000\nHello there.\n",
    ],
)
def test_two_who_speak_at_once_share_neither_face_nor_voice(text: str, plan_of: Planner) -> None:
    first, second = (line.casting for line in plan_of(text).lines)
    assert first.models.face != second.models.face
    assert first.request.get("voice") != second.request.get("voice")
    assert first.models == Models()


def test_a_role_decides_for_both(plan_of: Planner, tmp_path: Path) -> None:
    cast = cast_of(tmp_path, '[[role]]\nspeaker = "*"\nface = "noor"\n')
    assert [line.casting.models.face for line in plan_of(TWO, cast=cast).lines] == ["noor", "noor"]


def test_exports_of_several_cues_keep_one_face(plan_of: Planner) -> None:
    plan = plan_of(TWO, per="file", exports=("csv",))
    first, second = (line.casting for line in plan.lines)
    assert first.models == second.models
    assert first.request.get("voice") != second.request.get("voice")


def test_another_speaker_has_a_voice_of_the_language_and_the_other_sex() -> None:
    models, request = other_face(Models(), {"language": "de"}, 1)
    assert (request["voice"], models.face) == ("espeak", "ben")  # the drawn woman has the other one
    _, request = other_face(Models(face="head", identity="ravi"), {"voice": "espeak-female"}, 1)
    assert find_voice(request["voice"]).sex == "male"
    others = [other_face(Models(), {}, number) for number in (1, 2, 3)]
    assert len({models.face for models, _ in others}) == 3


def test_speakers_without_a_role_are_named(plan_of: Planner, tmp_path: Path) -> None:
    cast = cast_of(tmp_path, '[[role]]\nspeaker = "ANN"\nface = "mara"\n')
    text = (
        SRT.replace("Bob may", "JOHN: You may").replace("Good", "EVE: Good")
        + "\n4\n00:00:13,000 --> 00:00:14,000\n- No. - Yes.\n"
    )
    messages = [one.message for one in plan_of(text, cast=cast).warnings if one.file == "the cast"]
    assert messages == [
        "no role applies to EVE (1 line), JOHN (1 line), (no name) (1 line); they have the default face and voice"
    ]
    assert not [one for one in plan_of(text).warnings if "no role" in one.message]  # there are no roles at all


def test_all_speakers_are_listed_with_face_and_voice(plan_of: Planner, tmp_path: Path) -> None:
    cast = cast_of(tmp_path, '[[role]]\nspeaker = "ANN"\nface = "head"\nidentity = "kofi"\nvoice = "espeak"\n')
    found = planned_speakers(plan_of(SRT, cast=cast))
    assert [(one.name, one.n_lines, one.role, one.face, one.voice) for one in found] == [
        ("(no name)", 2, None, "ada", "heart"),
        ("ANN", 1, 1, "head kofi", "espeak"),
    ]


def test_signs_and_credits_are_left_out_and_take_no_time(plan_of: Planner, tmp_path: Path) -> None:
    cast = cast_of(
        tmp_path,
        '[[role]]\nsubtitle_style = "sign*"\nsilent = true\n[[role]]\ntext = "subtitles by *"\nsilent = true\n',
    )
    plan = plan_of(SIGNS, name="one.ass", cast=cast)
    assert [output.name for output in plan.outputs] == ["one-0001.mp4", "one-0004.mp4"]
    assert plan.outputs[0].cues[0].end_s == 3.0
    assert (plan.n_cues, plan.n_silent) == (4, 2)
    assert [line.segment is None for line in plan.lines] == [False, True, True, False]
    assert [one.message for one in plan.warnings if one.file == "the cast"] == [
        "no role applies to (no name) (2 lines); they have the default face and voice"
    ]


def test_silent_speakers_are_listed(plan_of: Planner, tmp_path: Path) -> None:
    cast = cast_of(tmp_path, '[[role]]\nspeaker = "ANN"\nsilent = true\n')
    found = planned_speakers(plan_of(SRT, cast=cast))
    assert [(one.name, one.n_lines, one.n_silent, one.role) for one in found] == [
        ("(no name)", 2, 0, None),
        ("ANN", 0, 1, 1),
    ]


def test_all_but_some_roles_can_be_left_out(plan_of: Planner, tmp_path: Path) -> None:
    cast = cast_of(tmp_path, '[default]\nsilent = true\n[[role]]\nspeaker = "ANN"\nsilent = false\n')
    assert [output.name for output in plan_of(SRT, cast=cast).outputs] == ["one-0001.mp4"]
    with pytest.raises(DataError, match='silent must be true or false, not "yes"'):
        cast_of(tmp_path, '[default]\nsilent = "yes"\n')


def test_what_nobody_says_is_left_out_unless_a_role_or_the_table_asks_for_it(plan_of: Planner, tmp_path: Path) -> None:
    content = SIGNS.replace("Default,", "Main,")
    plan = plan_of(content, name="one.ass")
    assert [line.segment is None for line in plan.lines] == [False, True, True, False]
    assert [note.message.partition(";")[0] for note in plan.notes] == [
        "1 sign, such as 'Keep out.', is not spoken",
        "1 credit, such as 'Subtitles by Somebody', is not spoken",
    ]
    cast = cast_of(tmp_path, '[[role]]\nsubtitle_style = "sign*"\nsilent = false\n')
    assert [line.segment is None for line in plan_of(content, name="one.ass", cast=cast).lines][1] is False
    kept = plan_of(content, name="one.ass", keep=("signs", "credits"))
    assert [line.segment is None for line in kept.lines] == [False] * 4
    assert not kept.notes


def test_a_sign_that_is_left_out_changes_no_face(plan_of: Planner) -> None:
    content = (
        "[Events]\nFormat: Start, End, Style, Text\n"
        "Dialogue: 0:00:01.00,0:00:03.00,Sign,Keep out\nDialogue: 0:00:01.00,0:00:03.00,Main,Hello there.\n"
    )
    assert [line.casting.other for line in plan_of(content, name="one.ass").lines if line.segment] == [0]


def test_words_of_no_length_are_of_one_person(plan_of: Planner) -> None:
    content = "".join(
        f"{number}\n00:00:0{begin} --> 00:00:0{end}\n{word}\n\n"
        for number, (begin, end, word) in enumerate(
            [("1,0", "1,5", "Come"), ("1,5", "1,5", "with"), ("1,5", "2,5", "me"), ("2,5", "3,5", "now.")], start=1
        )
    )
    lines = plan_of(content, per="file").lines
    assert [line.casting.other for line in lines] == [0, 0, 0, 0]
    assert len({line.segment.request["text"] for line in lines if line.segment}) == 1  # one sentence, cut at its words


def test_speakers_can_be_read_as_words(plan_of: Planner) -> None:
    plan = plan_of(speakers=False)
    assert next((line.speaker, line.text) for line in plan.lines) == ("", "ANN: Hello there.")
    assert [note.message.partition(",")[0] for note in plan_of().notes][-1].startswith(
        "speakers by names before a colon: ANN"
    )
