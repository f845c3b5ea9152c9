"""Rate and level of the voice under a style."""

import pytest

from lexicon.mark_parser import parse_marks
from lexicon.sentences import Sentence, split_sentences
from tts2face.request import Request
from tts2face.synthesis.marked_speech import sentence_sound, speak_sentence
from tts2face.synthesis.style_voice import DELIVERIES, PLAIN, Delivery, delivery_of
from tts2face.voice.loading import load_voice

TEXT = "We were away a year ago."


def sentence(text: str) -> Sentence:
    return next(iter(split_sentences(parse_marks(text, "en-us"), "en-us")))


def delivery(text: str = TEXT, **options: object) -> Delivery:
    one = sentence(text)
    return delivery_of(one.utterances[0], one.runs, Request(text=text, **options))  # type: ignore[arg-type]


@pytest.mark.parametrize("style", [None, "neutral", "measured", "grid_s1", "brows=annoyed"])
def test_other_styles_change_nothing(style: str | None) -> None:
    assert delivery(style=style) == PLAIN


def test_a_style_of_the_request_or_of_most_letters() -> None:
    assert delivery(style="depressed") == DELIVERIES["depressed"]
    assert delivery("[style:annoyed]We were away a year[/style] ago.") == DELIVERIES["annoyed"]
    assert delivery("[style:annoyed]We[/style] were away a year ago.") == PLAIN
    assert delivery("[style:delighted]We were away a year ago.[/style]", style="depressed") == DELIVERIES["delighted"]


def test_what_the_user_sets_replaces_the_style() -> None:
    assert delivery(style="depressed", plain_delivery=True) == PLAIN
    assert delivery(style="depressed", rate=1.2) == Delivery(1.0, -2.0)
    assert delivery(style="depressed", volume=0.5) == Delivery(0.9, 0.0)


def test_the_sound_is_slower_and_softer_and_the_motion_is_not_softer() -> None:
    voice = load_voice("heart", "en-us")
    plain, sad = (
        speak_sentence(voice, sentence(TEXT), Request(text=TEXT, style=style)) for style in (None, "depressed")
    )
    assert sad.speech.waveform.duration > 1.02 * plain.speech.waveform.duration
    level = [float((spoken.sound.samples**2).mean() ** 0.5) for spoken in (plain, sad)]
    assert level[1] < 0.9 * level[0]
    peak = [float(abs(spoken.speech.waveform.samples).max()) for spoken in (plain, sad)]
    assert peak[1] == pytest.approx(peak[0], rel=0.15)
    alone = sentence_sound(voice, sentence(TEXT), Request(text=TEXT, style="depressed"))
    assert alone.samples.tobytes() == sad.sound.samples.tobytes()
