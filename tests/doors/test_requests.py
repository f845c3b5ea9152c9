"""Every option of a request matters, and the same request gives the same bytes."""

import hashlib
import subprocess
import sys
from dataclasses import MISSING, fields, replace
from pathlib import Path

import numpy as np
import pytest

from lexicon.errors import DataError, InputError
from tests.world import ROOT, World
from tts2face.numeric.kernels import CACHE_VARIABLE, FOLDER
from tts2face.request import GESTURES, OPTIONS, TURN_S, FromSound, Idle, Listening, Recorded, Request, Spoken
from tts2face.session.session import Session
from tts2face.sound.voice_pool import VoicePool
from tts2face.source_options import LEAD_S, SOURCE_OPTIONS
from tts2face.types import Clip, concatenate_clips

TEXT = "Bob may move. We were away."
CHANGES = {
    "text": "Bob may move. You were away.",
    "language": "de",
    "voice": "espeak",
    "rate": 1.3,
    "voice_pitch": 3.0,
    "voice_range": 0.5,
    "volume": 0.5,
    "lead": 0.0,
    "spoken_mark": "auto",
    "seed": 7,
    "synthesis": "theobald2007",
    "context": 1,
    "exemplars": 3,
    "articulation": "natural",
    "fps": 25.0,
    "gestures": "ju2008",
    "pitch": True,
    "style": "delighted",
    "gain": "head=2,blink=0",
    "gaze": "camera",
    "listen": 0.5,
    "expression": "happy=0.6@0.2-0.9",
}
# tests/doors/test_audio.py changes these; idle animation, delivery and markup below
ELSEWHERE = {"audio", "audio_map", "idle", "partner", "plain_delivery", "markup", "text_marks"}


def test_an_option_of_a_source_is_a_field_of_one_with_the_same_default() -> None:
    sources = (Spoken("a"), Recorded(Path("a.wav")), FromSound("network"), Idle(1.0), Listening(1.0))
    taken = {name for source in sources for name in source.as_options()}
    missing = ", ".join({*SOURCE_OPTIONS} - taken)
    assert not missing, f"add {missing} to the sources of tts2face/request.py that have it"
    for one in fields(Spoken):
        default = SOURCE_OPTIONS[one.name].default
        assert one.default in {MISSING, default}, f"Spoken.{one.name} has another default than SourceOptions"


@pytest.fixture(scope="module")
def session(world: World) -> Session:
    """It keeps finished sentences: an option that the keys of `ResultMemory` lack would change nothing."""
    return world.session(memory_mb=100)


@pytest.fixture(scope="module")
def clip(session: Session) -> Clip:
    return session.clip(Request(text=TEXT))


def digest(clip: Clip) -> str:
    parts = (clip.motion.values, clip.head.values, clip.speech.waveform.samples, clip.speech.phones.edges)
    return hashlib.sha256(b"".join(part.tobytes() for part in parts)).hexdigest()


@pytest.mark.parametrize("name", [name for name in OPTIONS if name not in ELSEWHERE])
def test_every_option_changes_the_clip(name: str, clip: Clip, session: Session, tmp_path: Path) -> None:
    own = tmp_path / "own.txt"
    own.write_text("bob  B IY1 M\n")
    plan = tmp_path / "plan.json"
    plan.write_text('{"nods": [{"time": 0.4}]}')
    values = CHANGES | {"dictionary": own, "timeline": plan}
    assert name in values, f"add {name} to CHANGES, with a value that changes the clip"
    value = values[name]
    changed = session.clip(replace(Request(text=TEXT), **{name: value}))
    assert digest(changed) != digest(clip), (
        f"{name}={value!r} changes nothing: no step of tts2face.session reads {name}, or a step that keeps its result "
        "lacks it in its key"
    )


def test_a_plain_delivery_changes_the_clip_of_a_style(session: Session) -> None:
    plain, styled = (session.clip(Request(text=TEXT, style="depressed", plain_delivery=on)) for on in (True, False))
    assert styled.speech.waveform.duration > plain.speech.waveform.duration
    assert plain.speech.waveform.samples.tobytes() == session.clip(TEXT).speech.waveform.samples.tobytes()


def test_a_markup_changes_what_is_spoken(session: Session) -> None:
    text = 'Bob <break time="1s"/> may move.'
    seconds = {markup: session.clip(text, markup=markup).speech.waveform.duration for markup in ("auto", "ssml")}
    assert seconds["ssml"] == pytest.approx(1.0 + session.clip("Bob may move.").speech.waveform.duration, abs=0.4)
    assert seconds["auto"] == seconds["ssml"]
    assert session.clip(text, markup="plain").speech.waveform.duration > seconds["ssml"]  # the tag is spoken
    aside = "Bob may (happy) move."
    assert digest(session.clip(aside, markup="llm")) != digest(session.clip(aside))
    assert digest(session.clip("Bob may [nod] move.", markup="plain")) != digest(session.clip("Bob may [nod] move."))


def test_the_same_request_gives_the_same_bytes_in_another_process(clip: Clip, tmp_path: Path) -> None:
    code = (
        "import sys; from pathlib import Path; from tests.doors.test_requests import TEXT, digest\n"
        "from tests.world import make_world\n"
        "print(digest(make_world(Path(sys.argv[1])).session().clip(TEXT)))"
    )
    environment = {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "PATH": ""}
    environment |= {CACHE_VARIABLE: str(FOLDER), "HOME": str(tmp_path), "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code, str(tmp_path)]
    answer = subprocess.run(command, capture_output=True, text=True, env=environment, check=True)
    assert answer.stdout.strip() == digest(clip)


def test_a_voice_used_before_gives_the_same_bytes(world: World) -> None:
    fresh, ready = (world.session(voices=VoicePool()) for _ in range(2))
    for text in ("Something else was said. Bob may have been away.", TEXT):
        joined = concatenate_clips([piece.clip for piece in ready.stream(Request(text=text))])
    assert digest(joined) == digest(fresh.clip(TEXT))


def test_a_stream_is_the_whole_in_pieces(clip: Clip, session: Session) -> None:
    pieces = list(session.stream(Request(text=TEXT)))
    assert len(pieces) == 2
    assert digest(concatenate_clips([piece.clip for piece in pieces])) == digest(clip)


def test_every_method_of_gestures_is_another_clip_of_the_same_speech(clip: Clip, session: Session) -> None:
    made = {method: session.clip(TEXT, gestures=method) for method in GESTURES}
    assert digest(made["fields"]) == digest(clip)
    assert len({digest(one) for one in made.values()}) == len(GESTURES)
    for one in made.values():
        np.testing.assert_array_equal(one.speech.waveform.samples, clip.speech.waveform.samples)
    assert not made["none"].head.values.any()


@pytest.mark.parametrize(("seconds", "fps"), [(0.1, 30.0), (25.0, 29.97), (12.3, 7.0)])
def test_an_idle_clip_is_silent_and_has_the_requested_duration(seconds: float, fps: float, session: Session) -> None:
    pieces = list(session.stream(Request(idle=seconds, fps=fps)))
    clip = concatenate_clips([piece.clip for piece in pieces])
    assert clip.speech.waveform.duration == pytest.approx(seconds, abs=1.01 / fps)
    assert not clip.speech.waveform.samples.any()
    assert clip.speech.phones.phones == ("sil",)
    assert len(pieces) == -(-seconds // 10)
    assert sum(piece.n_steps for piece in pieces) == 1000


def test_a_face_listens_before_it_speaks(session: Session, clip: Clip) -> None:
    pieces = list(session.stream(TEXT, listen=10.5, seed=0))
    joined = concatenate_clips([piece.clip for piece in pieces])
    assert len(pieces) == 4
    assert sum(piece.n_steps for piece in pieces) == 1000 + sum(piece.n_steps for piece in session.stream(TEXT))
    later = 10.5 + TURN_S - LEAD_S  # the first sound leaves time for a breath
    assert joined.speech.waveform.duration == pytest.approx(clip.speech.waveform.duration + later, abs=0.05)
    assert joined.speech.phones.edges[1] == pytest.approx(clip.speech.phones.edges[1] + later, abs=0.04)
    first = round(10.5 * joined.speech.waveform.rate)
    assert not joined.speech.waveform.samples[:first].any()
    listened, plain = (jaw_before_speech(one) for one in (joined, session.clip(TEXT, lead=TURN_S, seed=0)))
    assert (listened - plain)[1:6].max() > 0.04  # the lips part for it
    assert abs(listened - plain)[-1] < 0.02


def jaw_before_speech(clip: Clip) -> np.ndarray:
    """Weights of the last eight frames before the first phone."""
    frame = round(clip.speech.phones.edges[1] * clip.fps)
    return clip.motion.values[frame - 8 : frame, clip.motion.channels.index("jawOpen")]


@pytest.mark.parametrize("fps", [23.976, 24.0, 25.0, 29.97, 50.0, 59.94])
def test_pieces_end_on_frames_at_any_rate(fps: float, session: Session) -> None:
    """Sound and picture of a long text stay together: each piece's sound is as long as its frames, to half a sample."""
    *pieces, last = session.stream(Request(text="One. Two. Three.", fps=fps))
    assert len(pieces) == 2
    n_frames = sum(len(piece.clip.motion) for piece in pieces)
    n_samples = sum(len(piece.clip.speech.waveform.samples) for piece in pieces)
    rate = last.clip.speech.waveform.rate
    assert abs(n_samples / rate - n_frames / last.clip.fps) < 1 / rate
    assert 0.0 <= len(last.clip.motion) / last.clip.fps - last.clip.speech.waveform.duration + 0.01 / fps < 1.02 / fps


def test_lips_rest_in_silence_and_at_both_ends(session: Session) -> None:
    """They begin to move 0.2 s before the first sound; when that is differs a little between processors."""
    spoken = session.clip(Request(text=TEXT, gestures="none", lead=0.4))
    weights, first_sound_s = spoken.motion.values, spoken.speech.phones.edges[1]
    n_resting = int((first_sound_s - 0.2) * spoken.motion.fps) + 1
    assert n_resting >= 3
    for frame in (0, -1):
        assert np.abs(weights[frame] - weights[0]).max() < 1e-4
    assert np.abs(np.diff(weights[:n_resting], axis=0)).max() < 0.02


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"text": ""}, "nothing to say"),
        ({"text": " "}, "nothing to say"),
        ({"language": "xx-none"}, "no language 'xx-none'"),
        ({"voice": "nobody"}, "no voice 'nobody'"),
        ({"dictionary": Path("missing.txt")}, "missing.txt cannot be read"),
    ],
)
def test_requests_that_cannot_be_spoken_are_refused(change: dict, reason: str, session: Session) -> None:
    with pytest.raises((InputError, DataError), match=reason):
        session.clip(replace(Request(text=TEXT), **change))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"rate": 5.0}, "rate must lie between 0.5 and 2, not 5"),
        ({"volume": -1.0}, "volume must lie between 0 and 2, not -1"),
        ({"fps": 500.0}, "fps must lie between 1 and 120, not 500"),
        ({"fps": float("nan")}, "fps must be a number, not NaN"),
        ({"seed": -1}, "seed must be 0 or more, not -1"),
        ({"seed": 1.5}, "seed must be a whole number, not 1.5"),
        ({"seed": -(10**5000)}, "seed is too large a number"),
        ({"style": 7}, "style must be a text in quotes, not 7"),
        ({"exemplars": "3"}, 'exemplars must be a whole number, not "3"'),
        ({"dictionary": "a\0b"}, r"dictionary is a path with the character U\+0000"),
        ({"synthesis": "magic"}, "no synthesis 'magic'"),
        ({"articulation": "mumbled"}, "articulation must be natural, clear or a factor from 0.5 to 2, not 'mumbled'"),
        ({"articulation": "2.5"}, "articulation must lie between 0.5 and 2, not 2.5"),
        ({"articulation": "nan"}, "articulation must lie between 0.5 and 2"),
        ({"articulation": "clear", "idle": 2.0, "text": ""}, "--articulation has no effect with --idle; remove one"),
        (
            {"articulation": "clear", "audio": Path("speech.wav"), "text": "", "audio_map": "network"},
            "--articulation needs the phones of a recording; remove it, or --audio-map",
        ),
        ({"idle": 5.0}, "--idle cannot be combined with text or --audio; remove one of them"),
        (
            {"idle": 5.0, "text": "", "voice": "espeak"},
            "--lead and --spoken-mark have no effect with --idle; remove them",
        ),
        ({"idle": 0.0, "text": ""}, "idle must lie between 0.01 and 3600, not 0"),
        (
            {"listen": 5.0, "audio": Path("speech.wav"), "text": ""},
            "--listen cannot be combined with --audio or --idle",
        ),
        ({"listen": 5.0, "text": "", "rate": 1.2}, "--spoken-mark need a text after --listen; add one, or remove them"),
        ({"partner": Path("other.wav")}, "--partner needs a face that listens; add --listen with the seconds"),
        ({"gaze": "up"}, "no gaze 'up'; choose conversation or camera"),
        ({"gestures": "none", "gaze": "camera"}, "have no effect with --gestures none"),
        ({"gestures": "none", "style": "calm"}, "have no effect with --gestures none"),
        ({"gestures": "none", "pitch": True}, "have no effect with --gestures none"),
        ({"gestures": "noise", "pitch": True}, "--pitch has no effect with --gestures noise; remove one of them"),
    ],
)
def test_options_out_of_range_are_refused(change: dict, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        Request(**{"text": "Hi.", **change})


def test_an_articulation_is_a_name_or_a_factor(clip: Clip, session: Session) -> None:
    by_name = [session.clip(TEXT, articulation=given) for given in ("natural", 1.0, "1")]
    assert len({digest(one) for one in by_name}) == 1
    assert digest(session.clip(TEXT, articulation="clear")) == digest(clip)  # the default of a mesh
    assert digest(session.clip(TEXT, articulation="1.5")) == digest(clip)
