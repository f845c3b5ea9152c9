"""Marked texts through every door: clips with pauses, times of marks on the clock of the whole clip."""

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from cli.main import run
from lexicon.sequence import SILENCE
from tests.tones import RATE_HZ
from tests.world import World
from tts2face.gestures.elements import StyleSpan
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.session import Session
from tts2face.session.speech_stream import Piece
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import concatenate_clips
from tts2face.video.media import read_media_info

pytestmark = pytest.mark.usefixtures("heard_once")
SMALL = Picture(size="64x64")


@pytest.fixture(scope="module")
def ready(session: Session) -> Session:
    return session


def pieces(text: str, ready: Session, **options: object) -> list[Piece]:
    return list(ready.stream(Request(text=text, **options)))


def words(found: list[Piece]) -> dict[str, float]:
    """Onset of each word on the whole clip's clock."""
    speech = concatenate_clips([piece.clip for piece in found]).speech
    return {word.text.strip("."): float(speech.phones.edges[word.first]) for word in speech.words}


@pytest.mark.parametrize("fps", [29.97, 60.0, 7.0])
def test_marks_come_with_their_words_on_the_whole_clip_s_clock(fps: float, ready: Session) -> None:
    text = "One two. [style:head=annoyed]Three [nod]four. Five. Six [pause 0.7]seven[/style] eight. [nod]Nine."
    found = pieces(text, ready, fps=fps)
    at = words(found)
    nods = [nod.time for piece in found for nod in piece.timeline.gestures]
    np.testing.assert_allclose(nods, [at["four"], at["Nine"]], atol=1e-3)
    spans = [span for piece in found for span in piece.timeline.spans]
    assert all(isinstance(span, StyleSpan) and span.feature == "head" for span in spans)
    for before, after in pairwise(spans):
        assert after.start == pytest.approx(before.end, abs=1 / RATE_HZ)
    assert spans[0].start == pytest.approx(len(found[0].clip.motion) / found[0].clip.fps)
    assert at["seven"] < spans[-1].end <= at["eight"] + 1 / RATE_HZ


def test_a_pause_is_silent_and_the_lips_rest_in_it(shipped: Session) -> None:
    texts = ("Bob may go away.", "Bob may [pause 3] go away.")
    (plain,), (paused,) = (list(shipped.stream(Request(text=text, gestures="none"))) for text in texts)
    phones = paused.clip.speech.phones
    assert phones.phones.count(SILENCE) == 3
    middle = phones.phones.index(SILENCE, 1)
    assert phones.durations[middle] == pytest.approx(3.0, abs=1e-3)
    frame = round(float(phones.edges[middle : middle + 2].mean()) * paused.clip.fps)
    assert np.abs(paused.clip.motion.values[frame] - paused.clip.motion.values[0]).max() < 1e-3
    assert len(paused.clip.motion) > len(plain.clip.motion) + 30


def test_a_document_with_voices_languages_and_phones_is_one_sound(world: World, voices: VoicePool) -> None:
    session = world.session(voices=voices)
    text = (
        '<speak>One <phoneme ph="kæt">two</phoneme>. <lang xml:lang="de">Guten Tag.</lang> <voice gender="male">Three '
        '<say-as interpret-as="ordinal">4</say-as></voice> <voice name="heart">five.</voice></speak>'
    )
    for voice, rate in (("espeak", 22_050), ("heart", 24_000)):
        speech = concatenate_clips([piece.clip for piece in session.stream(Request(text=text, voice=voice))]).speech
        assert speech.waveform.rate == rate
        names = [word.text.strip(".") for word in speech.words]
        assert names == ["One", "two", "Guten", "Tag", "Three", "fourth", "five"]
        first, last = speech.words[1].first, speech.words[1].last
        assert speech.phones.phones[first:last] == ("k", "æ", "t")


def test_one_foreign_letter_is_named_and_a_word_is_spoken(ready: Session) -> None:
    (piece,) = pieces("The value of π is 3.", ready)
    assert "pi" in [word.text for word in piece.clip.speech.words]
    (piece,) = pieces("Hello Привет.", ready)
    words, phones = piece.clip.speech.words, piece.clip.speech.phones.phones
    assert words[1].text.startswith("Привет")
    assert phones[words[1].first : words[1].last] == ("p", "r", "i", "v", "e", "t")


def test_a_file_with_marks_counts_characters_and_tells_the_times_of_names(ready: Session, tmp_path: Path) -> None:
    text = '<speak>Hello <mark name="here"/>there. <break time="1s"/>Bye.</speak>'
    reported: list[tuple[int, int]] = []
    request = Request(text=text, fps=5.0)
    written = ready.write(request, tmp_path / "a.mp4", picture=SMALL, on_progress=lambda *step: reported.append(step))
    (here,) = written.marks
    assert here.name == "here"
    assert 0.3 < here.seconds < 1.2
    assert reported[-1] == (len("Hello there. Bye."),) * 2
    assert [done for done, _ in reported] == sorted(done for done, _ in reported)
    assert read_media_info(tmp_path / "a.mp4").duration == pytest.approx(written.seconds, abs=0.2)


def test_the_command_makes_the_pause(tones: World, tmp_path: Path) -> None:
    lengths = []
    for number, text in enumerate(("Hello there.", "Hello [pause 2] there.")):
        out = tmp_path / f"{number}.mp4"
        assert run([text, "--out", str(out), "--size", "64x64", "--fps", "5", *tones.flags]) == 0
        lengths.append(read_media_info(out).duration)
    assert 1.7 < lengths[1] - lengths[0] < 2.5


def test_phones_are_those_of_the_words(capsys: pytest.CaptureFixture[str]) -> None:
    reported = []
    for text in ("Hello there.", "Hello [pause 2] there."):
        assert run(["phones", text]) == 0
        reported.append(capsys.readouterr().out)
    assert reported[0] == reported[1]


def test_phones_are_those_that_the_text_gives(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["phones", '<speak>A <phoneme ph="kæt">dog</phoneme>.</speak>']) == 0
    assert capsys.readouterr().out.splitlines()[-1].split() == ["dog", "dog.", "kæt", "K", "AE0", "T"]


def test_the_command_tells_when_names_are_reached(
    tones: World, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = '<speak>Hello <mark name="the place"/>there.</speak>'
    assert run([text, "--out", str(tmp_path / "a.gif"), "--size", "64x64", "--fps", "5", *tones.flags]) == 0
    assert capsys.readouterr().err.rstrip().endswith("s: the place")


def test_a_recording_s_words_carry_marks(ready: Session, takes: Path) -> None:
    film = takes / "clips" / "bbaf2n.mkv"
    found = list(
        ready.stream(Request(audio=film, text="bin [style:head=annoyed]blue at F[/style] two [nod]now", fps=60.0))
    )
    at = words(found)
    assert [nod.time for piece in found for nod in piece.timeline.gestures] == pytest.approx([at["now"]])
    spans = [span for piece in found for span in piece.timeline.spans]
    assert spans[0].start == pytest.approx(at["blue"])
    assert at["F"] < spans[-1].end <= at["two"] + 1e-6
