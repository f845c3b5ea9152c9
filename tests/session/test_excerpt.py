"""Excerpts of speech: the words of some letters, as they sound in their sentence."""

from dataclasses import replace

import numpy as np
import pytest

from lexicon.sentence_length import n_letters
from lexicon.sequence import SILENCE
from tests.tones import PHONE_S
from tests.world import World
from tts2face.request import Request
from tts2face.session.joining import CUT_SILENCE_S, Excerpt
from tts2face.session.prepared import PreparedRequest, prepare
from tts2face.source_options import LEAD_S

PARTS = ("When Bob may move,", "the big maps", "are away. We were away.")


def excerpt(number: int, **request: object) -> PreparedRequest:
    first = sum(map(n_letters, PARTS[:number]))
    whole = prepare(Request(text=" ".join(PARTS), fps=10, **request))
    return replace(whole, excerpt=Excerpt(first, first + n_letters(PARTS[number])))


@pytest.mark.parametrize("number", [0, 1, 2])
def test_the_words_of_a_part_are_kept_with_the_silence_of_the_request(number: int, world: World) -> None:
    session = world.session()
    (piece,) = session.stream_speech(excerpt(number))
    speech = piece.speech
    assert [word.text for word in speech.words] == PARTS[number].split()
    assert piece.text == PARTS[number]
    span = session.measure_speech(excerpt(number))
    assert span.begin == pytest.approx(LEAD_S, abs=0.02)
    assert span.total - span.end <= CUT_SILENCE_S + 0.1 + 0.35 * (number == 2)  # a frame; the voice's own end
    loud = np.flatnonzero(np.abs(speech.waveform.samples) > 0.01) / speech.waveform.rate
    assert loud[0] == pytest.approx(LEAD_S, abs=0.02)


def test_parts_have_the_phones_of_the_whole(world: World) -> None:
    session = world.session()
    whole = [one.speech for one in session.stream_speech(" ".join(PARTS), fps=10)]
    parts = [one.speech for number in range(3) for one in session.stream_speech(excerpt(number))]
    spoken = [[phone for one in group for phone in one.phones.phones if phone != SILENCE] for group in (whole, parts)]
    assert spoken[0] == spoken[1]
    lengths = [float(end - begin) for one in parts for begin, end in _spans(one)]
    assert np.allclose(lengths, PHONE_S, atol=0.02)


def _spans(speech: object) -> list[tuple[float, float]]:
    phones = speech.phones
    edges = zip(phones.edges, phones.edges[1:], phones.phones, strict=False)
    return [(begin, end) for begin, end, phone in edges if phone != SILENCE]


def test_a_clip_of_a_part_has_its_length(world: World) -> None:
    session = world.session()
    clips = list(session.stream_to_length(excerpt(1), 40))
    assert sum(len(clip.motion) for clip in clips) == 40
    assert [word.text for clip in clips for word in clip.speech.words] == ["the", "big", "maps"]
