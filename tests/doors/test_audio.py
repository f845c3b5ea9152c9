"""Lip motion from recordings: with their words, by their sound alone; refusal of silent recordings."""

import json
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest
from soxr import resample

from cli.main import run
from corpus_tools.training.linear_audio_map import TrainingUtterance, learn_linear_map
from corpus_tools.training.network_audio_map import NetworkMapOptions, learn_network_map
from lexicon.errors import DataError, InputError
from lexicon.sequence import SILENCE
from tests.rendered_takes import ONLY_RENDERED
from tests.world import World
from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
from tts2face.models.landmarks import lip_opening
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker, write_talker
from tts2face.request import Request
from tts2face.session.recording import MAX_CLIP_FRAMES, map_audio_to_motion, resample_motion, select_audio_map
from tts2face.session.session import Session
from tts2face.sound import transcript
from tts2face.sound.features import FEATURE_RATE, speech_features
from tts2face.sound.listener import StreamingAudioMap
from tts2face.sound.voice_pool import VoicePool
from tts2face.types import Trajectory, concatenate_clips, frame_count
from tts2face.video.media import read_media_info, read_sound, sound_blocks

pytestmark = pytest.mark.usefixtures("heard_once")
TEXT = "bin blue at F two now"
TOLERANCE_S = 0.04  # of the takes' own word times, which are automatic as well
LEARNT_FROM = 60  # utterances: enough to be far better than nothing
SUFFIXES = {".wav": "pcm_s16le", ".flac": "flac", ".mp3": "libmp3lame", ".m4a": "aac", ".ogg": "libopus"}


@pytest.fixture(scope="module")
def film(takes: Path) -> Path:
    return takes / "clips" / "bbaf2n.mkv"


@pytest.fixture(scope="module")
def talker() -> Talker:
    return load_talker("grid_s1")


@pytest.fixture(scope="module")
def session(talker: Talker, world: World, voices: VoicePool) -> Session:
    """The shipped talker, which hears, on the made face."""
    return world.session(talker=talker, voices=voices)


@pytest.fixture(scope="module")
def held_out(shared_recordings: Path) -> Talker:
    """The shipped talker with audio maps trained on all recordings but the tested one."""
    clips = shared_recordings / "grid_s1" / "clips"
    shipped = load_talker("grid_s1")
    spoken = [one for one in shipped.utterances if one.name != "bbaf2n"][:: len(shipped.utterances) // LEARNT_FROM]
    lessons = []
    for one in spoken:
        sound = read_sound(clips / f"{one.name}.mkv", FEATURE_RATE)
        features = speech_features(sound, "mfcc", fps=shipped.fps, n_frames=len(one.shape)).values
        lessons.append(TrainingUtterance(features, one.shape[:, : shipped.model.n_speech]))
    network = learn_network_map(lessons, feature="mfcc", options=NetworkMapOptions())
    return replace(shipped, audio_maps={"linear": learn_linear_map(lessons, feature="mfcc"), "network": network})


def write_wave(path: Path, samples: np.ndarray, rate: int = 16000) -> Path:
    with av.open(str(path), "w") as container:
        stream = container.add_stream(SUFFIXES[path.suffix], rate=rate)
        stream.layout = "mono"
        frame = av.AudioFrame.from_ndarray((samples * 32767).astype(np.int16)[None], format="s16", layout="mono")
        frame.rate, frame.pts = rate, 0
        resampled = av.AudioResampler(stream.format, "mono", rate).resample(frame)
        for part in [*resampled, None]:
            container.mux(stream.encode(part))
    return path


def opening(motion: np.ndarray, talker: Talker) -> np.ndarray:
    shapes = talker.model.shapes(motion)
    return np.linalg.norm(shapes[:, 13] - shapes[:, 14], axis=1)


@pytest.mark.parametrize(("audio_map", "least"), [("linear", 0.5), ("network", 0.65)])
def test_lips_that_hear_a_new_sentence_move_as_the_speaker_s(
    audio_map: str, least: float, shared_recordings: Path, held_out: Talker
) -> None:
    talker, film = held_out, shared_recordings / "grid_s1" / "clips" / "bbaf2n.mkv"
    _, lips = map_audio_to_motion(film, talker.audio_maps[audio_map], talker, talker.fps)
    (real,) = (one.shape for one in talker.utterances if one.name == "bbaf2n")
    n = min(len(real), len(lips))
    assert np.corrcoef(opening(real[:n], talker), opening(lips.values[:n], talker))[0, 1] > least


@pytest.mark.parametrize("audio_map", ["linear", "network"])
def test_lips_open_with_the_sound_of_a_rendered_take(audio_map: str, rendered_takes: Path, talker: Talker) -> None:
    """Against the opening that the take's own phones give the talker."""
    film = rendered_takes / "clips" / "bbaf2n.mkv"
    _, lips = map_audio_to_motion(film, talker.audio_maps[audio_map], talker, talker.fps)
    found = opening(lips.values, talker)
    words = [line.split() for line in (rendered_takes / "align" / "bbaf2n.align").read_text().splitlines()]
    spoken = np.zeros(len(found), bool)
    for begin, end, word in words:
        if word != "sil":
            spoken[round(int(begin) / 1000) : round(int(end) / 1000)] = True
    assert np.median(found[spoken]) > 2 * np.median(found[~spoken])


def test_with_a_transcript_lips_close_at_the_bilabials(takes: Path, film: Path, session: Session) -> None:
    clip = session.clip(Request(audio=film, text=TEXT, fps=25.0))
    assert [word.text for word in clip.speech.words] == TEXT.split()
    words = [line.split() for line in (takes / "align" / "bbaf2n.align").read_text().splitlines()]
    (begin,) = (int(begin) / 25_000 for begin, _, word in words if word == "bin")
    said = [phone for phone in clip.speech.phones.phones if phone != "sil"]
    assert said[:3] == ["b", "ɪ", "n"]
    starts = clip.speech.phones.edges[clip.speech.phones.phones.index("b")]
    assert abs(starts - begin) < TOLERANCE_S


@ONLY_RENDERED
def test_audio_maps_and_words_give_different_lips(film: Path, session: Session) -> None:
    requests = (
        Request(audio=film),
        Request(audio=film, audio_map="network"),
        Request(audio=film, audio_map="linear"),
        Request(audio=film, text=TEXT),
        Request(audio=film, volume=0.5),
    )
    default, network, linear, words, quiet = (session.clip(one) for one in requests)
    assert not np.array_equal(default.motion.values, network.motion.values)
    assert len(default.speech.phones) > 10
    assert not np.array_equal(network.motion.values, linear.motion.values)
    assert not np.array_equal(network.motion.values, words.motion.values)
    np.testing.assert_allclose(quiet.speech.waveform.samples, 0.5 * default.speech.waveform.samples, atol=1e-6)


@pytest.mark.parametrize("fps", [23.976, 25.0, 60.0])
def test_sound_and_picture_are_equally_long(fps: float, film: Path, session: Session) -> None:
    clip = session.clip(Request(audio=film, fps=fps))
    sound = read_sound(film, 48000)
    assert len(clip.motion) == frame_count(sound.duration, clip.fps)
    n = min(len(sound.samples), len(clip.speech.waveform.samples))
    np.testing.assert_allclose(clip.speech.waveform.samples[:n], sound.samples[:n], atol=1e-4)


@ONLY_RENDERED
@pytest.mark.parametrize("text", ["", f"{TEXT} {TEXT} {TEXT} {TEXT} {TEXT}"])
def test_a_long_recording_is_divided_into_pieces(text: str, film: Path, session: Session, here: Path) -> None:
    samples = read_sound(film, 16000).samples
    sound = write_wave(here / "long.wav", np.tile(samples, 5))
    pieces = list(session.stream(Request(audio=sound, text=text, fps=60.0)))
    lengths = [len(piece.clip.motion) for piece in pieces[:-1]]
    assert all(MAX_CLIP_FRAMES // 2 < length <= MAX_CLIP_FRAMES for length in lengths)
    assert all(piece.speech.phones.phones[-1] == SILENCE for piece in pieces[:-1])  # no word is cut
    assert sum(piece.n_steps for piece in pieces) == 1000
    whole = concatenate_clips([piece.clip for piece in pieces])
    assert whole.speech.waveform.duration == pytest.approx(len(whole.motion) / 60.0, abs=1e-3)
    if text:
        assert len(whole.speech.words) == len(text.split())


def test_progress_begins_while_the_words_of_a_long_recording_are_found(
    film: Path, session: Session, here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its parts are heard and aligned before the first frame is drawn."""
    monkeypatch.setattr(transcript, "MAX_ALIGNED_S", 5.0)
    monkeypatch.setattr(transcript, "MAX_STRETCH_S", 4.0)
    sound = write_wave(here / "long.wav", np.tile(read_sound(film, 16000).samples, 3))
    seen: list[tuple[int, int]] = []
    request = Request(audio=sound, text="bin blue at F two now " * 3, fps=5.0)
    session.export(request, (here / "motion.csv",), on_progress=lambda done, of: seen.append((done, of)))
    steps = [done for done, _ in seen]
    assert steps == sorted(steps)
    assert len({step for step in steps if step <= 300}) >= 4
    assert seen[-1] == (1000, 1000)


@pytest.mark.parametrize("suffix", sorted(SUFFIXES))
def test_files_of_sound_alone_are_read(suffix: str, here: Path) -> None:
    tone = 0.3 * np.sin(2 * np.pi * 440 * np.arange(16000) / 16000)
    path = write_wave(here / f"tone{suffix}", tone)
    blocks = np.concatenate(list(sound_blocks(path, 48000)))
    assert len(blocks) == pytest.approx(48000, abs=4000)  # codecs pad
    spectrum = np.abs(np.fft.rfft(blocks))
    assert np.argmax(spectrum) * 48000 / len(blocks) == pytest.approx(440, abs=2)
    np.testing.assert_allclose(blocks, read_sound(path, 48000).samples, atol=1e-4)


def test_a_faint_recording_moves_the_lips_as_a_loud_one(film: Path, talker: Talker, here: Path) -> None:
    sound = read_sound(film, 16000).samples
    audio_map = replace(talker.audio_maps["network"], loudness=-18.0)
    loud, faint = (
        map_audio_to_motion(write_wave(here / f"{gain}.wav", gain * sound), audio_map, talker, 25.0)[1].values
        for gain in (1.0, 0.1)
    )
    spread = talker.model.spread[: talker.model.n_speech]
    assert np.median(np.abs(loud - faint) / spread) < 0.1  # 16-bit quantisation noise remains


def test_interpolated_motion_passes_through_the_frames() -> None:
    values = np.random.default_rng(0).normal(size=(20, 3)).astype(np.float32)
    np.testing.assert_allclose(resample_motion(values, 25.0, 50.0, 39)[::2], values, atol=1e-5)
    line = np.arange(20, dtype=np.float32)[:, None]
    np.testing.assert_allclose(resample_motion(line, 25.0, 30.0, 22)[2:-2, 0], np.arange(22)[2:-2] / 30 * 25, atol=1e-4)


@ONLY_RENDERED
def test_the_command_writes_clips(film: Path, talker: Talker, world: World, here: Path) -> None:
    write_talker(here / "me.talker", talker)
    (here / "said.txt").write_text(TEXT)
    models = ["--talker", "me.talker", "--face", str(world.face_file), "--palette", str(world.palette_file)]
    common = ["--audio", str(film), *models, "--size", "64x64", "--fps", "5", "--quiet"]
    for out, more in (
        ("sound.mp4", []),
        ("linear.mp4", ["--audio-map", "linear"]),
        ("text.mp4", ["--text", TEXT]),
        ("words.mp4", [TEXT]),
        ("script.mp4", ["--transcript", "said.txt", "--explain", "why.json"]),
    ):
        assert run([*common, *more, "--out", out]) == 0
        facts = read_media_info(here / out)
        assert facts.rate == 48000
        assert facts.duration == pytest.approx(3.0, abs=0.25)
    assert (here / "why.json").stat().st_size > 100


@pytest.mark.parametrize(
    ("samples", "reason"), [(np.zeros(16000), "is silent"), (0.1 * np.ones(800), r"lasts 0\.050 s; give a recording")]
)
@pytest.mark.parametrize("text", ["", TEXT])
def test_unusable_sound_is_refused(samples: np.ndarray, reason: str, text: str, session: Session, here: Path) -> None:
    path = write_wave(here / "a.wav", samples)
    with pytest.raises(DataError, match=reason):
        session.clip(Request(audio=path, text=text))


def test_files_without_sound_are_refused(session: Session, here: Path) -> None:
    (here / "empty.wav").touch()
    (here / "text.wav").write_text("hello " * 100)
    for path, reason in (("empty.wav", "is empty"), ("text.wav", "cannot be read as video or sound")):
        with pytest.raises(DataError, match=reason):
            session.clip(Request(audio=here / path))


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"audio_map": "magic"}, "no audio map 'magic'; choose phones, voices, network or linear"),
        ({"audio_map": "linear", "audio": None, "text": "Hi."}, "--audio-map needs a recording"),
        ({"audio_map": "linear", "text": "Hi."}, "remove --audio-map or the text"),
        ({"voice": "espeak"}, "--voice-range, --lead and --spoken-mark have no effect on a recording"),
        ({"rate": 1.5}, "--voice-range, --lead and --spoken-mark have no effect on a recording"),
    ],
)
def test_options_that_exclude_each_other_are_refused(options: dict, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        Request(**{"audio": Path("a.wav"), **options})


@ONLY_RENDERED
def test_a_missing_recording_and_a_talker_without_audio_maps_are_refused(
    film: Path, session: Session, talker: Talker, world: World
) -> None:
    mute = world.session(talker=replace(talker, audio_maps={}))
    with pytest.raises(InputError, match=r"there is no recording none\.wav"):
        session.clip(Request(audio=Path("none.wav")))
    with pytest.raises(InputError, match="has no network audio map"):
        mute.clip(Request(audio=film, audio_map="network"))
    assert mute.clip(Request(audio=film)).speech.words == ()


def test_the_text_is_given_once(here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["Hi.", "--text", "Hi.", "--out", "a.mp4"]) == 2
    assert "the text is given twice" in capsys.readouterr().err


def test_live_lips_hold_for_another_voice(session: Session, talker: Talker) -> None:
    """They open as those of the words do, by the default map; by that of the talker's own voice less so."""
    text = "The young chef usually pushes five big maps."
    speech = session.clip(Request(text=text, gestures="none")).speech
    sound = resample(speech.waveform.samples, speech.waveform.rate, FEATURE_RATE)
    n_frames = int(speech.waveform.duration * talker.fps)
    model = build_exemplar_model(talker)
    truth = speech_trajectory(speech.phones, model, fps=talker.fps, n_frames=n_frames).values
    near = {}
    for name in ("voices", "network"):
        lips = StreamingAudioMap(select_audio_map(name, talker))
        made = np.concatenate([*(lips.add_samples(block) for block in np.array_split(sound, 40)), lips.finish()])
        openings = [lip_opening(talker.model.shapes(motion[:n_frames])) for motion in (truth, made)]
        near[name] = float(np.corrcoef(*openings)[0, 1])
    assert near["voices"] > 0.6
    assert near["network"] < near["voices"] - 0.05
    assert select_audio_map(None, talker) is talker.audio_maps["voices"]
    assert len(session.listen(audio_map="linear").add_samples(sound[:16_000]) or ()) > 20


@ONLY_RENDERED
def test_an_explanation_needs_phones(film: Path, world: World, here: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["--audio", str(film), "--audio-map", "network", "--explain", "why.json"]) == 2
    assert "or the words of --audio" in capsys.readouterr().err
    assert run(["--audio", str(film), "--explain", str(here / "why.json"), "--face", str(world.face_file)]) == 0
    assert "the words are not given" in capsys.readouterr().err
    assert len(json.loads((here / "why.json").read_text())) > 5


@ONLY_RENDERED
def test_lips_are_in_the_talker_s_channels(film: Path, talker: Talker) -> None:
    said, lips = map_audio_to_motion(film, talker.audio_maps["linear"], talker, 30.0)
    assert isinstance(lips, Trajectory)
    assert said.phones.phones == ("sil",)
    assert lips.channels == tuple(f"shape{i}" for i in range(talker.model.n_speech))
