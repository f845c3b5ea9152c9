"""Containers and exports of batches."""

import json
import wave
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest

from lexicon.errors import BackendError, InputError
from tests.packages import package
from tests.picture.tiny_talker import own_talker
from tests.serving.batch.build.test_run import AAC_SMEAR_S, decoded, manifest, spans
from tests.serving.batch.conftest import FPS, SMALL, SRT, Planner
from tests.tones import PHONE_S, LetterVoice
from tts2face import load_clip
from tts2face.interchange.exports import table
from tts2face.interchange.exports.table import batch_format, sound_name
from tts2face.picture.options import Picture
from tts2face.picture.own_face import OwnFaceRenderer, own_face_renderer
from tts2face.request import Request
from tts2face.serving.batch.cast import Cast, Role
from tts2face.serving.batch.options import BatchOptions
from tts2face.serving.batch.plan import plan_batch
from tts2face.serving.batch.render import _writer
from tts2face.serving.batch.run import run_batch
from tts2face.serving.batch.segment import Segment
from tts2face.session.inspection import inspect_file
from tts2face.session.named_models import Models
from tts2face.session.prepared import prepare
from tts2face.storage.marks import Making

CUES = ((0.5, "Hello there"), (2.5, "Good morning to you all"), (10.0, "Bob may move"))


@pytest.mark.parametrize("kind", ["webm", "mov"])
def test_other_containers_are_joined_frame_by_frame(
    kind: str, plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    result = run_batch(plan_of(per="file", format=kind), tmp_path / "out")
    assert (result.n_made, result.failed) == (1, ())
    with av.open(str(tmp_path / "out" / f"one.{kind}")) as movie:
        times = [frame.time for frame in movie.decode(movie.streams.video[0])]
        codecs = movie.streams.video[0].codec_context.name, movie.streams.audio[0].codec_context.name
        movie.seek(0)
        sound = np.concatenate(
            [frame.to_ndarray().reshape(-1) for frame in movie.decode(movie.streams.audio[0])]
        ).astype(float)
    assert codecs == {"webm": ("vp9", "opus"), "mov": ("h264", "pcm_s16le")}[kind]
    assert np.allclose(times, np.arange(125) / FPS, atol=0.002)  # s; .webm counts milliseconds
    begins = [begin for begin, _ in spans(sound / np.abs(sound).max(), 48_000)]  # Opus removes the offset of this voice
    for begin, _ in CUES:
        assert min(abs(one - begin) for one in begins) < AAC_SMEAR_S


def test_webm_keeps_transparency(tmp_path: Path, voices: list[LetterVoice]) -> None:
    (tmp_path / "one.srt").write_text(SRT, encoding="utf-8")
    picture = Picture(size="64x64", supersampling=1, background="transparent")
    options, request = BatchOptions(per="scene", format="webm"), Request(fps=FPS)
    run_batch(plan_batch([tmp_path / "one.srt"], options, request=request, picture=picture), tmp_path / "out")
    with av.open(str(tmp_path / "out" / "one-scene-001.webm")) as movie:
        stream = movie.streams.video[0]
        assert {name.lower(): value for name, value in stream.metadata.items()}["alpha_mode"] == "1"
        decoder = av.CodecContext.create("libvpx-vp9", "r")  # FFmpeg's own decoder ignores the coverage
        frames = [frame for packet in movie.demux(stream) for frame in decoder.decode(packet)]
    assert len(frames) == 56  # one of them before the first cue, and two seconds after the last one
    for frame in (frames[0], frames[-1]):
        coverage = frame.to_ndarray(format="rgba")[:, :, 3]
        assert coverage[0, 0] < 5  # of 255; the coding is lossy
        assert coverage[32, 32] > 250


def test_exports_have_the_frames_and_times_of_the_film(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    out = tmp_path / "out"
    exports = ("track.json", "wav", "words.srt", "azure", "glb")
    result = run_batch(plan_of(per="file", exports=exports), out)
    assert result.failed == ()
    clip = load_clip(out / "one.track.json")
    assert (len(clip.motion), len(clip.speech.waveform.samples), clip.speech.waveform.rate) == (125, 600_000, 48_000)
    words = [(word.text, float(clip.speech.phones.edges[word.first])) for word in clip.speech.words]
    expected = []
    for (begin, text), cue in zip(CUES, manifest(out)["outputs"][0]["cues"], strict=True):
        at = begin
        for word in text.split():
            expected.append((word.lower(), at))
            at += len(word) * PHONE_S / cue["rate"]
    assert [text.lower().strip(".") for text, _ in words] == [text for text, _ in expected]
    assert np.allclose([time for _, time in words], [time for _, time in expected], atol=1e-4)
    with wave.open(str(out / "one.wav")) as file:
        sound = np.frombuffer(file.readframes(-1), "<i2") / 32768.0
    _, in_movie, rate = decoded(out / "one.mp4")
    for (begin, end), (own_begin, own_end) in zip(spans(sound, 48_000), spans(in_movie, rate), strict=True):
        assert abs(begin - own_begin) < AAC_SMEAR_S
        assert abs(end - own_end) < AAC_SMEAR_S
    (entry,) = manifest(out)["outputs"]
    assert {one["file"] for one in entry["exports"]} == {
        "one.track.json", "one.wav", "one.words.srt", "one.azure.jsonl", "one.glb"
    }  # fmt: skip
    times = [json.loads(line) for line in (out / "one.azure.jsonl").read_text().splitlines()]
    last = times[-1]["audio_offset"] + times[-1]["duration"]
    assert abs(last / 1e7 - 12.5) < 1e-3


def test_exports_are_made_again_only_where_needed(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run_batch(plan_of(), out).n_rendered == 3
    added = run_batch(plan_of(exports=("csv", "textgrid")), out)
    assert (added.n_rendered, added.n_made) == (3, 3)  # tracks; the videos' segments are stored
    again = run_batch(plan_of(exports=("csv", "textgrid")), out)
    assert (again.n_rendered, again.n_made, again.n_current) == (0, 0, 3)
    (out / "one-0002.textgrid").unlink()
    restored = run_batch(plan_of(exports=("csv", "textgrid")), out)
    assert (restored.n_rendered, restored.n_made) == (0, 1)
    changed = run_batch(plan_of(SRT.replace("Bob", "Tom"), exports=("csv", "textgrid")), out)
    assert (changed.n_rendered, changed.n_made) == (2, 1)


@pytest.mark.smoke
def test_exports_alone_draw_nothing(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    out = tmp_path / "out"
    plan = plan_of(per="film", format="none", exports=("npz", "bvh"))
    assert {segment.medium for segment in plan.segments.values()} == {"track"}
    result = run_batch(plan, out)
    assert (result.n_made, result.failed) == (1, ())
    assert {path.name for path in out.iterdir() if path.is_file()} == {
        "film.npz", "film.bvh", "manifest.json", "manifest.csv"
    }  # fmt: skip
    assert len(np.load(out / "film.npz")["motion"]) == 125
    assert manifest(out)["outputs"][0]["n_frames"] == 125
    assert run_batch(plan, out).n_current == 1


@pytest.mark.smoke
def test_faces_of_one_export_must_be_equal(plan_of: Planner) -> None:
    cast = Cast(roles=(Role({"speaker": "ANN"}, {"face": "head"}),))
    assert len(plan_of(cast=cast, models=None, exports=("glb",)).outputs) == 3
    with pytest.raises(InputError, match=r"one-scene-001 shows 2 faces \(head starter, ada starter\)"):
        plan_of(cast=cast, models=None, per="scene", exports=("glb",))


@pytest.mark.smoke
def test_exports_with_a_mesh_need_a_face_with_one(plan_of: Planner) -> None:
    cast = Cast(default={"face": "self"})
    assert plan_of(cast=cast, exports=("srt",)).outputs
    with pytest.raises(InputError, match="talker's own face, which glb cannot show"):
        plan_of(cast=cast, exports=("glb",))


@pytest.mark.smoke
def test_a_missing_package_is_named_before_anything_is_rendered(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "find_spec", lambda _: None)
    with pytest.raises(BackendError, match=r"\.usda needs the package pxr"):
        BatchOptions(exports=("usda",))


@pytest.mark.smoke
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"format": "avi"}, "--format must be"),
        ({"format": "none"}, "add --export"),
        ({"exports": ("fbx",)}, "there is no export format 'fbx'"),
        ({"exports": ("glb", ".glb")}, "given twice"),
    ],
)
def test_wrong_formats_are_refused(options: dict[str, object], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        BatchOptions(**options)


@pytest.mark.smoke
def test_transparent_mov_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.srt").write_text(SRT, encoding="utf-8")
    with pytest.raises(InputError, match=r"\.mov has no transparency; choose --format webm"):
        plan_batch([tmp_path / "a.srt"], BatchOptions(format="mov"), picture=Picture(background="transparent"))


@pytest.mark.smoke
def test_endings_and_names_select_a_format() -> None:
    assert [batch_format(name)[0] for name in ("glb", ".usdc", "livelink", "track.json", "textgrid")] == [
        ".glb", ".usdc", ".csv", ".track.json", ".textgrid"
    ]  # fmt: skip


@pytest.mark.smoke
def test_sound_beside_keeps_points_in_the_name() -> None:
    assert sound_name("Show.S01E01-0001.glb") == "Show.S01E01-0001.wav"
    assert sound_name("hello.rhubarb.json") == "hello.wav"


def test_speech_that_is_cut_keeps_its_phones(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    text = (
        "1\n00:00:00,500 --> 00:00:01,000\nHello there you lot of people.\n\n2\n00:00:01,000 --> 00:00:02,000\nBye.\n"
    )
    run_batch(plan_of(text, per="file", overflow="report", format="none", exports=("track.json",)), tmp_path / "out")
    speech = load_clip(tmp_path / "out" / "one.track.json").speech
    voiced = [float(speech.phones.edges[k]) for k, phone in enumerate(speech.phones.phones) if phone != "sil"]
    assert [time for time in voiced if 0.5 < time < 1.0]
    assert Fraction(len(speech.waveform.samples), 48_000) == Fraction(3)
    assert SMALL.width == 64


def test_a_talkers_video_returns_to_its_first_frame_at_joins(tmp_path: Path) -> None:
    renderer = own_face_renderer(own_talker(), Picture(size="96x96"))

    class OwnSession:
        def renderer(self, *_: object, **__: object) -> OwnFaceRenderer:
            return renderer

        def making(self, _: object) -> Making:
            return Making()

    segment = Segment({"text": "Hello."}, {}, Models(face="self"), 15)
    writer = _writer(OwnSession(), segment, prepare(Request(text="Hello.")), (tmp_path / "x.mov", 15))
    assert writer._renderer.n_returning == 15


def test_outputs_are_signed_and_made_again_for_another_signer(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    package("c2pa")
    signer = package("tests.storage.authority").issue(tmp_path).open()
    plan = plan_of(per="file", exports=("wav",))
    assert run_batch(plan, tmp_path / "out", signer=signer).n_made == 1
    assert run_batch(plan, tmp_path / "out", signer=signer).n_made == 0
    for name in ("one.mp4", "one.wav"):
        found = inspect_file(tmp_path / "out" / name)
        assert found.signature is not None
        assert (found.signature.state, found.signature.signer) == ("Valid", "Ann")
        assert "Hello there" in found.text
    (entry,) = manifest(tmp_path / "out")["outputs"]
    assert entry["signed_by"] == signer.fingerprint
    assert run_batch(plan, tmp_path / "out").n_made == 1
    assert inspect_file(tmp_path / "out" / "one.mp4").signature is None
