"""Sessions: their clips can be drawn, they are thread-safe, and options are checked."""

import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import tts2face
from lexicon.errors import InputError
from tests.golden.requests import with_pictures
from tests.walkers import unmarked
from tests.world import World
from tts2face.session.performance import Performance
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import concatenate_clips

TEXTS = ("Bob may move.", "We were away.", "Five big maps.", "Hello there.")
SMALL = tts2face.Picture(size="64x64", supersampling=1)


@pytest.fixture(scope="module")
def session(world: World) -> tts2face.Session:
    return world.session()


@pytest.fixture(scope="module")
def own(world: World) -> tts2face.Session:
    """A session that shows its talker's own face."""
    return world.session(talker=with_pictures(world.talker), face="self")


def test_a_clip_moves_the_face_s_own_shapes_first(session: tts2face.Session, world: World) -> None:
    clip = session.clip("Bob may move.")
    own = world.face.shape_names
    assert clip.motion.channels[: len(own)] == own
    assert clip.motion.channels == session.face.channels
    assert len(clip.motion.channels) > len(own)


@pytest.mark.parametrize("options", [{}, {"gestures": "none"}, {"idle": 0.5}], ids=["gestures", "lips only", "idle"])
def test_what_a_session_returns_can_be_drawn(
    options: dict[str, object], session: tts2face.Session, tmp_path: Path
) -> None:
    clip = session.clip("" if "idle" in options else "Bob may.", **options)
    tts2face.write_clip(clip, session.face, tmp_path / "again", picture=SMALL)
    session.write("" if "idle" in options else "Bob may.", tmp_path / "at_once", picture=SMALL, **options)
    again, at_once = (sorted((tmp_path / name).glob("*.png")) for name in ("again", "at_once"))
    assert len(again) == len(clip.motion)
    assert [*map(unmarked, again)] == [*map(unmarked, at_once)]  # a clip alone does not know its text


def test_speech_is_synthesised_while_the_renderer_is_built(
    session: tts2face.Session, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    begun, models, build = threading.Event(), session._models, session._models.renderer
    synthesise, waited = type(models).pieces, []

    def pieces(*given):  # type: ignore[no-untyped-def]
        begun.set()
        yield from synthesise(*given)

    def renderer(*given, **named):  # type: ignore[no-untyped-def]
        waited.append(begun.wait(20))
        return build(*given, **named)

    monkeypatch.setattr(type(models), "pieces", pieces)
    monkeypatch.setattr(models, "renderer", renderer)
    written = session.write("Bob may.", tmp_path / "frames", picture=SMALL)
    assert waited == [True]
    assert written.n_frames == len(list((tmp_path / "frames").glob("*.png")))


def test_a_talker_s_own_face_is_drawn_by_the_same_calls(own: tts2face.Session, tmp_path: Path) -> None:
    clip = own.clip("Bob may.", fps=25)
    tts2face.write_clip(clip, own.face, tmp_path / "own", picture=SMALL)
    assert len(list((tmp_path / "own").glob("*.png"))) == len(clip.motion)
    with pytest.raises(InputError, match="has no mesh"):
        _ = own.mesh


def test_a_clip_of_another_face_is_refused(own: tts2face.Session, session: tts2face.Session, tmp_path: Path) -> None:
    clip = own.clip("Bob.", fps=25)
    with pytest.raises(InputError, match="not in the shapes of this face"):
        tts2face.write_clip(clip, session.face, tmp_path / "a", picture=SMALL)


def test_threads_get_the_same_clips_as_a_single_thread(world: World, voices: VoicePool) -> None:
    session = world.session(voices=voices)
    alone = [world.session(voices=voices).clip(text, seed=2) for text in TEXTS]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(lambda text: session.clip(text, seed=2), TEXTS * 2))
    for one, other in zip(alone * 2, together, strict=True):
        assert np.array_equal(one.motion.values, other.motion.values)
        assert np.array_equal(one.head.values, other.head.values)
        assert np.array_equal(one.speech.waveform.samples, other.speech.waveform.samples)


def test_a_stream_is_the_clip_in_pieces(session: tts2face.Session) -> None:
    pieces = list(session.stream("Bob may move. We were away.", fps=25))
    whole = session.clip("Bob may move. We were away.", fps=25)
    assert [piece.begin for piece in pieces] == [0.0, len(pieces[0].clip.motion) / 25]
    assert np.array_equal(concatenate_clips([piece.clip for piece in pieces]).motion.values, whole.motion.values)
    assert [phone.phone for phone in pieces[1].explain()][:3] == ["sil", "w", "i"]
    assert pieces[1].explain()[0].start >= pieces[1].begin


@pytest.mark.parametrize(
    ("call", "reason"),
    [
        (lambda session: session.clip("Hello.", stile="delighted"), "there is no option 'stile'"),
        (
            lambda session: session.clip(tts2face.Request(text="Hello."), seed=1),
            "with a complete request",
        ),
        (lambda session: session.clip("Hello.", style="gleeful"), "no style 'gleeful'"),
        (lambda session: session.write("Hello.", "a.mp4", sise="64x64"), "there is no option 'sise'"),
        (lambda session: session.write("Hello.", "a.avi"), "a.avi"),
        (lambda session: tts2face.Session(face="self"), "motion only"),
        (lambda session: tts2face.Session(face="self", identity="kofi"), "no identity presets"),
        (lambda session: tts2face.Session(talker="nobody"), "nobody"),
    ],
)
def test_wrong_calls_are_refused(call: object, reason: str, session: tts2face.Session) -> None:
    assert callable(call)
    with pytest.raises(InputError, match=reason):
        call(session)


@pytest.mark.parametrize(
    ("replaced", "name"), [("take.csv", "the take"), ("sound.flac", "audio"), ("back.png", "background")]
)
def test_a_performance_does_not_replace_its_inputs(
    replaced: str, name: str, session: tts2face.Session, tmp_path: Path
) -> None:
    take, sound, background = (tmp_path / file for file in ("take.csv", "sound.flac", "back.png"))
    for path in (take, sound):
        path.write_bytes(b"recorded")
    Image.new("RGB", (64, 64)).save(background)
    (tmp_path / "out.mp4").symlink_to(tmp_path / replaced)
    content = (tmp_path / replaced).read_bytes()
    picture = tts2face.Picture(size="64x64", background=str(background))
    with pytest.raises(InputError, match=rf"out .*out\.mp4 would replace {name}; choose another name"):
        session.write_performance(Performance(take=take, audio=sound), tmp_path / "out.mp4", picture=picture)
    assert (tmp_path / "out.mp4").read_bytes() == content


def test_a_session_without_a_palette_moves_lips_alone(world: World) -> None:
    bare = world.session(palette=None)
    clip = bare.clip("Bob may move.")
    assert clip.motion.channels == world.face.shape_names
    assert not clip.head.values.any()


def test_voices_in_use_are_not_counted_as_cached(world: World, voices: VoicePool) -> None:
    session = world.session(voices=voices)
    text = '<speak>One. <voice name="heart">Two.</voice> <lang xml:lang="de">Drei.</lang> Four.</speak>'
    spoken = [word.text for _ in range(2) for word in session.clip(text, voice="espeak").speech.words]
    assert [word.strip(".") for word in spoken] == ["One", "Two", "Drei", "Four"] * 2
