"""Rate, level, pitch and range of the voice under a style."""

from dataclasses import replace

import pytest

from lexicon.sentences import Sentence, split_sentences
from lexicon.text_marks import parse_marks
from tests.world import World
from tts2face.models.palette import PLAIN, Delivery
from tts2face.models.palette_editing import StyleMix, add_derivation, mix_styles
from tts2face.models.palette_file import load_palette
from tts2face.request import Request
from tts2face.session.phrase_delivery import delivery_of
from tts2face.session.speech import sentence_sound, speak_sentence
from tts2face.sound.voice_pool import VoicePool

DELIVERIES = load_palette("starter").deliveries
TEXT = "We were away a year ago."


def sentence(text: str) -> Sentence:
    return next(iter(split_sentences(parse_marks(text, "en-us"), "en-us")))


def delivery(text: str = TEXT, **options: object) -> Delivery:
    one = sentence(text)
    request = Request(text=text, **options)  # type: ignore[arg-type]
    return delivery_of(one.utterances[0], one.runs, request, DELIVERIES)


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
    sad = DELIVERIES["depressed"]
    assert sad == Delivery(0.9, -2.0, -1.5, 0.7)
    assert delivery(style="depressed", rate=1.2) == replace(sad, rate=1.0)
    assert delivery(style="depressed", volume=0.5) == replace(sad, level_db=0.0)
    assert delivery(style="depressed", voice_pitch=2.0) == replace(sad, pitch=0.0)
    assert delivery(style="depressed", voice_range=0.5) == replace(sad, range=1.0)
    marked = '<speak><prosody pitch="+2st" duration="2s">We were away.</prosody></speak>'
    assert delivery(marked, style="depressed") == Delivery(1.0, -2.0, 0.0, 0.7)
    assert delivery("We were *not* away.", style="depressed") == sad  # emphasis is beside the style


def test_the_sound_is_slower_and_softer_and_the_motion_is_not_softer(voices: VoicePool) -> None:
    voice = voices.voice("heart", "en-us", {})
    plain, sad = (
        speak_sentence(voice, sentence(TEXT), Request(text=TEXT, style=style), deliveries=DELIVERIES)
        for style in (None, "depressed")
    )
    assert sad.speech.waveform.duration > 1.02 * plain.speech.waveform.duration
    level = [float((spoken.sound.samples**2).mean() ** 0.5) for spoken in (plain, sad)]
    assert level[1] < 0.9 * level[0]
    peak = [float(abs(spoken.speech.waveform.samples).max()) for spoken in (plain, sad)]
    assert peak[1] == pytest.approx(peak[0], rel=0.15)
    alone = sentence_sound(voice, sentence(TEXT), Request(text=TEXT, style="depressed"), deliveries=DELIVERIES)
    assert alone.samples.tobytes() == sad.sound.samples.tobytes()


def test_a_style_of_ones_own_speaks_as_those_that_it_is_mixed_of(world: World) -> None:
    palette = load_palette("starter")
    half = mix_styles(palette, StyleMix("grid_s1", {"depressed": 0.5}))
    assert half.delivery.rate == pytest.approx(0.9**0.5)
    assert half.delivery.level_db == pytest.approx(-1.0)
    assert half.delivery.pitch == pytest.approx(-0.75)
    assert half.delivery.range == pytest.approx(0.7**0.5)
    assert mix_styles(palette, StyleMix("grid_s1", tempo=2.0)).delivery == PLAIN
    seconds = []
    for name in ("sombre", "depressed", "neutral"):
        own = add_derivation(palette, "sombre", mix_styles(palette, StyleMix("grid_s1", {"depressed": 1.0})))
        speech = world.session(palette=own).clip(TEXT, style=name, fps=10).speech
        seconds.append(speech.phones.edges[-2] - speech.phones.edges[1])
    assert seconds[0] == pytest.approx(seconds[1], abs=1e-6)
    assert seconds[0] > 1.05 * seconds[2]
