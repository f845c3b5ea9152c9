"""What a listener does: nods and raised brows, a still head, few blinks, and the mood it shows."""

import wave
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.studies.gestures.blinks import find_blinks
from lexicon.errors import InputError
from tests.world import World
from tts2face.gestures.elements import Gesture, ListeningSpan
from tts2face.gestures.listening import (
    LASTS_S,
    LEAST_GAP_S,
    WAIT_S,
    PartnerSound,
    cue_times,
    drawn_times,
    responses,
    with_responses,
)
from tts2face.gestures.stream import GestureFields, GestureStream
from tts2face.gestures.timeline import Timeline
from tts2face.models.palette import EXPRESSIONS, Palette
from tts2face.request import Request
from tts2face.session.prepared import prepare
from tts2face.storage.wave_files import pcm_bytes
from tts2face.types import Waveform

FPS, RATE = 30.0, 16_000
HEARD = Timeline(listens=(ListeningSpan(0.0, 600.0),))


def test_responses_at_intervals_are_as_many_as_look_natural_and_the_same_in_pieces() -> None:
    times = drawn_times(0.0, 3600.0, 1)
    assert 6 <= len(times) / 60 <= 12  # Poppe, Truong and Heylen 2011
    assert np.diff(times).min() > 2.0
    parts = [drawn_times(begin, begin + 0.2, 1) for begin in np.arange(0, 60, 0.2)]
    assert [time for part in parts for time in part] == drawn_times(0.0, 60.0, 1)
    assert drawn_times(0.0, 60.0, 2) != drawn_times(0.0, 60.0, 1)


def test_a_response_nods_or_raises_the_brows() -> None:
    times = np.arange(0, 4000, 10.0).tolist()
    made = responses(times, 3)
    nodded = {round(one.time / 10) for one in made.gestures if one.name == "nod"}
    raised = {round(one.time / 10) for one in made.gestures if one.name == "brows_up"}
    assert nodded | raised == set(range(400))
    assert len(nodded) / 400 == pytest.approx(0.75, abs=0.06)
    assert 0.3 < len(raised) / 400 < 0.7
    assert responses(times[5:7], 3).gestures == tuple(nod for nod in made.gestures if 45 < nod.time < 65)


def test_spans_respond_where_they_hold_and_react() -> None:
    spans = (ListeningSpan(0.0, 100.0), ListeningSpan(200.0, 300.0, reacts=False))
    found = with_responses(Timeline(listens=spans, gestures=(Gesture(250.0),)), 0.0, 400.0, 1)
    own = [nod.time for nod in found.gestures if nod.time != 250.0]
    assert own
    assert max(own) < 100.0 + LASTS_S
    assert len(found.gestures) == len(own) + 1
    plain = Timeline(gestures=(Gesture(250.0),))
    assert with_responses(plain, 0.0, 400.0, 1) is plain


def spoken(parts: list[tuple[float, float]]) -> Waveform:
    """A voice as parts of seconds and Hz; 0 is a pause."""
    samples, phase = [], 0.0
    for seconds, hertz in parts:
        steps = np.full(round(seconds * RATE), hertz / RATE)
        phases = phase + np.cumsum(steps)
        phase = float(phases[-1])
        pulses = sum(np.sin(2 * np.pi * k * phases) / k for k in range(1, 9))
        samples.append(0.1 * pulses if hertz else np.zeros(len(steps)))
    return Waveform(np.concatenate(samples), RATE)


def test_a_listener_responds_after_low_pitch_and_at_pauses() -> None:
    fall = spoken([(3.0, 220.0), (1.0, 120.0), (3.0, 220.0)])
    (time,) = cue_times(fall)
    assert time == pytest.approx(3.0 + 0.11 + WAIT_S, abs=0.08)
    pause = spoken([(2.0, 200.0), (1.0, 0.0), (2.0, 200.0)])
    assert cue_times(pause)[0] == pytest.approx(2.0 + 0.3, abs=0.08)
    assert cue_times(spoken([(0.4, 200.0), (1.0, 0.0)])) == []  # too little was said
    assert cue_times(Waveform(np.zeros(RATE), RATE)) == []


def test_responses_to_speech_are_apart_and_not_too_many() -> None:
    sentence = [(1.2, 210.0), (0.9, 180.0), (0.5, 130.0), (0.5, 0.0)]
    times = cue_times(spoken(sentence * 12))
    assert np.diff(times).min() >= LEAST_GAP_S - 1e-6
    assert 6 <= len(times) / (12 * 3.1 / 60) <= 13


@pytest.mark.parametrize(("style", "fps"), [("neutral", 30.0), ("depressed", 29.97)])
def test_listening_in_short_pieces_is_as_at_once(world: World, style: str, fps: float) -> None:
    n_pieces, n, fields = 30, 6, GestureFields(world.palette)
    whole = GestureStream(fields, style=style, seed=1, fps=fps)
    silence = Waveform(np.zeros(8000 * n_pieces), 8000)
    at_once = whole.next(silence, n_pieces * n, Timeline(listens=(ListeningSpan(0.0, 60.0),)))
    stream, parts, known = GestureStream(fields, style=style, seed=1, fps=fps), [], Timeline()
    for piece in range(n_pieces):
        begin, end = float(Fraction(piece * n) / Fraction(fps)), float(Fraction(piece * n + n) / Fraction(fps))
        known = known.restrict(begin - 1.0, np.inf).merge(Timeline(listens=(ListeningSpan(begin, end),)))
        parts.append(stream.next(Waveform(np.zeros(1600), 8000), n, known))
    for name in at_once:
        np.testing.assert_allclose(np.concatenate([part[name] for part in parts]), at_once[name], atol=2e-5)


@pytest.fixture(scope="module")
def clips(starter_of: Callable[..., Palette]) -> dict[str, dict[str, np.ndarray]]:
    """Silence of two minutes, with a face that listens and one that does not."""
    silence = Waveform(np.zeros(120 * 8000), 8000)
    mood, face = (GestureFields(starter_of("expression", *more)) for more in ((), ("blink", "gaze", "head")))
    return {
        f"{style}{' listens' if timeline.listens else ''}": GestureStream(fields, style=style, seed=2, fps=FPS).next(
            silence, round(120 * FPS), timeline
        )
        for fields, style, timeline in (
            (face, "neutral", Timeline()), (face, "neutral", HEARD), (mood, "depressed", HEARD)
        )
    }  # fmt: skip


def test_listeners_blink_as_in_silence_and_hold_the_head_still(clips) -> None:
    plain, heard = clips["neutral"], clips["neutral listens"]
    rates = [
        find_blinks(one["blink"], np.array([len(one["blink"])], np.int32), FPS).per_minute for one in (plain, heard)
    ]
    assert all(10 <= rate <= 24 for rate in rates)  # 17 in silence: Bentivoglio et al. 1997
    spreads = [np.degrees(one["head"][60:, 1].std()) for one in (plain, heard)]
    assert spreads[1] < 0.7 * spreads[0]


def test_a_friendly_listener_smiles_and_a_sad_one_does_not(clips) -> None:
    happy, sad = EXPRESSIONS.index("happy"), EXPRESSIONS.index("sad")
    smiles = {name: one["expression"][60:, happy].mean() for name, one in clips.items()}
    assert smiles["neutral listens"] > 1.15 * smiles["neutral"]
    assert smiles["depressed listens"] < 0.1
    assert clips["depressed listens"]["expression"][60:, sad].mean() > 0.7


@pytest.mark.parametrize("rate", [RATE, 44_100])
def test_cues_of_a_sound_in_blocks_come_once_and_in_time(rate: int) -> None:
    sound = spoken([(1.2, 210.0), (0.9, 180.0), (0.5, 130.0), (0.5, 0.0)] * 5)
    heard, told, sent = PartnerSound(rate), [], sound.resampled(rate).samples
    for begin in range(0, len(sent), rate // 5):
        heard.add(sent[begin : begin + rate // 5])
        end = min(begin + rate // 5, len(sent)) / rate
        told += [end + cue for cue in heard.new_cues()]
    assert np.diff(told).min() >= LEAST_GAP_S - 0.5
    assert 0.6 * len(cue_times(sound)) <= len(told) <= len(cue_times(sound)) + 1


def test_the_sound_of_a_partner_gives_the_responses_of_a_request(tmp_path: Path) -> None:
    sound = spoken([(1.2, 210.0), (0.9, 180.0), (0.5, 130.0), (0.5, 0.0)] * 4)
    path = tmp_path / "other.wav"
    with wave.open(str(path), "wb") as file:
        file.setparams((1, 2, RATE, 0, "NONE", ""))
        file.writeframes(pcm_bytes(sound.samples))
    heard = prepare(Request(listen=10.0, partner=path)).listening
    assert [span.reacts for span in heard.listens] == [False]
    begins = {one.time for one in heard.gestures}
    cues = [time for time in cue_times(sound) if time < 10.0]
    assert cues
    assert all(min(abs(time - cue) for time in begins) < 0.05 for cue in cues)
    alone = prepare(Request(listen=10.0)).listening
    assert ([span.reacts for span in alone.listens], alone.gestures) == ([True], ())
    with pytest.raises(InputError, match=r"there is no recording nowhere\.wav"):
        prepare(Request(listen=10.0, partner=Path("nowhere.wav")))
