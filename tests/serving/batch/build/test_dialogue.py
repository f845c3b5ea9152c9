"""Lines close together: sentences over several cues, last words that sound on, one background for all faces."""

import wave
from dataclasses import replace
from pathlib import Path

import av
import numpy as np
import pytest

from lexicon.sentence_length import n_letters
from tests.serving.batch.build.test_run import AAC_SMEAR_S, decoded, manifest, spans
from tests.serving.batch.build.test_tracks import write_wav
from tests.serving.batch.conftest import FPS, SMALL, Planner
from tests.tones import PHONE_S, LetterVoice
from tests.world import World
from tts2face.models.face_loading import load_face
from tts2face.picture.scene import draw_background
from tts2face.request import DRAWN_FACE, Request
from tts2face.serving.batch import render
from tts2face.serving.batch.cast import Cast
from tts2face.serving.batch.export import joined_clips
from tts2face.serving.batch.fit import RELEASE_S
from tts2face.serving.batch.render import SegmentRenderer, _writer
from tts2face.serving.batch.report import measure_plan
from tts2face.serving.batch.run import SEGMENT_FOLDER, run_batch
from tts2face.serving.batch.store import open_store
from tts2face.session.prepared import prepare

SENTENCE = (
    "1\n00:00:01,000 --> 00:00:02,500\nWhen I was a boy,\n\n"
    "2\n00:00:02,500 --> 00:00:04,000\nmy father told me\n\n"
    "3\n00:00:04,200 --> 00:00:05,700\na story.\n"
)
OVERLAP = (
    "1\n00:00:01,000 --> 00:00:01,500\nBOB: abcdefgh ijklmno.\n\n2\n00:00:01,500 --> 00:00:03,000\nEVE: abcdefgh ijk.\n"
)
RECORDED = ((0.9, 0.0, 0.0), (1.2, 0.2, 0.0), (1.6, 0.3, 0.3))  # seconds spoken in a slot of 1 s, sounding on, cut


@pytest.mark.parametrize("per", ["file", "cue"])
def test_a_sentence_is_spoken_as_one_and_cut_back_at_its_words(
    per: str, plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    run_batch(plan_of(SENTENCE, per=per), tmp_path / "out")
    said = {text for voice in voices for text, _ in voice.said}
    assert said == {"When I was a boy, my father told me a story."}
    for output in manifest(tmp_path / "out")["outputs"]:
        _, samples, rate = decoded(tmp_path / "out" / output["file"])
        heard = [span for span in spans(samples, rate) if span[1] - span[0] > AAC_SMEAR_S]
        for (begin, end), cue in zip(heard, output["cues"], strict=True):
            assert abs(output["begin_s"] + begin - cue["begin_s"]) < AAC_SMEAR_S
            assert abs(end - begin - n_letters(cue["text"].strip(".,")) * PHONE_S) < AAC_SMEAR_S
            assert cue["rate"] == 1.0


def test_one_rate_for_all_cues_of_a_sentence(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    text = SENTENCE.replace("my father told me", "my old father often told me")
    run_batch(plan_of(text, per="file"), tmp_path / "out")
    (output,) = manifest(tmp_path / "out")["outputs"]
    rates = [cue["rate"] for cue in output["cues"]]
    assert rates[0] > 1.0
    assert len(set(rates)) == 1


def sound_of(path: Path) -> np.ndarray:
    with av.open(str(path)) as movie:
        return (
            np.concatenate([frame.to_ndarray().reshape(-1) for frame in movie.decode(movie.streams.audio[0])]) / 32768
        )


def test_last_words_sound_on_while_the_next_cue_begins(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    plan = plan_of(OVERLAP, per="file", format="mov", exports=("wav",), cast=Cast({"volume": 0.4}))
    run_batch(plan, tmp_path / "out")
    (output,) = manifest(tmp_path / "out")["outputs"]
    first, second = output["cues"]
    assert (first["rate"] > 1.4, first["cut_s"]) == (True, 0.0)
    assert 0.25 < first["overlap_s"] <= 0.3
    told = f"the last {first['overlap_s']:.2f} s of the speech sound on after the next cue has begun"
    assert any(told in one for one in output["warnings"])
    sound = np.abs(sound_of(tmp_path / "out" / "one.mov"))
    assert len(sound) / 48_000 == output["n_frames"] / FPS
    both, alone = (
        sound[round(begin * 48_000) : round(end * 48_000)].mean() for begin, end in ((1.55, 1.7), (1.85, 2.0))
    )
    assert both > 1.7 * alone
    assert abs(second["begin_s"] - 1.5) < 1e-6
    with wave.open(str(tmp_path / "out" / "one.wav")) as file:
        exported = np.frombuffer(file.readframes(-1), "<i2") / 32768
    assert len(exported) == len(sound)
    assert abs(np.abs(exported[round(1.55 * 48_000) :][:7200]).mean() - both) < 0.02


def test_what_sounds_on_in_the_last_track_has_no_frames(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    plan = plan_of(OVERLAP, per="file", format="none", exports=("csv",))
    (output,) = plan.outputs
    (segment,) = [
        one for one in output.tracks if "BOB" not in str(one.request) and one.request.get("text", "").endswith("mno.")
    ]
    path = tmp_path / "a.track.json"
    result = SegmentRenderer().render(segment, path)
    frames = [len(clip.motion) for clip in joined_clips([path], FPS, lengths=[result.n_frames])]
    assert sum(frames) == result.n_frames
    assert sum(len(clip.motion) for clip in joined_clips([path], FPS)) > result.n_frames


def test_words_for_which_there_is_no_time_are_left_out_whole(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    text = OVERLAP.replace("ijklmno.", "ijklmno pqrstuvw.")
    run_batch(plan_of(text, per="file", format="mov"), tmp_path / "out")
    (output,) = manifest(tmp_path / "out")["outputs"]
    assert any("'pqrstuvw.' is not spoken, as the next cue begins" in one for one in output["warnings"])
    assert abs(output["cues"][0]["speech_s"] - 15 * PHONE_S / 2.0) < AAC_SMEAR_S
    assert output["cues"][0]["cut_s"] > 0.3


def test_the_plan_states_the_fits_of_the_run(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    plan = plan_of(SENTENCE, per="file")
    planned = measure_plan(plan)
    run_batch(plan, tmp_path / "out")
    store = open_store(tmp_path / "out" / SEGMENT_FOLDER)
    for line in plan.lines:
        made = store.result(line.segment.address)
        assert made is not None
        fit = planned[line.segment.address]
        assert (fit.rate, fit.speech_s, fit.n_frames) == (made.rate, made.speech_s, made.n_frames)
    assert measure_plan(plan, store).keys() == planned.keys()


def test_faces_without_a_studio_stand_before_that_of_the_drawn_faces(
    plan_of: Planner, world: World, tmp_path: Path
) -> None:
    segment = plan_of(SENTENCE).outputs[0].segments[0]
    shown = _writer(world.session(), segment, prepare(Request(text="Hello.")), (tmp_path / "a.mov", 10))
    studio = load_face(DRAWN_FACE).light.baked.backdrop
    assert np.array_equal(shown._renderer.scene.background, draw_background(SMALL, studio))
    assert not np.array_equal(shown._renderer.scene.background, draw_background(SMALL))
    green = replace(segment, picture={"background": "green"})
    shown = _writer(world.session(), green, prepare(Request(text="Hello.")), (tmp_path / "b.mov", 10))
    assert len(np.unique(shown._renderer.scene.background.reshape(-1, 3), axis=0)) == 1


@pytest.mark.parametrize("case", RECORDED)
def test_a_recording_sounds_on_up_to_the_limit(
    case: tuple[float, float, float],
    plan_of: Planner,
    world: World,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    sound, (spoken, overlap_s, cut_s) = tmp_path / "a.wav", case
    write_wav(sound, np.full(round(spoken * 48_000), 0.5))
    monkeypatch.setattr(render, "fit_recording", lambda _session, request, _segment: (request, spoken, []))
    segment = replace(plan_of(OVERLAP, per="file").lines[0].segment, slot_frames=10, lead_frames=0)
    _, result = render.fit_segment(world.session(), Request(text="abc", audio=sound, fps=FPS), segment)
    assert (result.n_frames, result.overlap_s, result.cut_s) == (10, pytest.approx(overlap_s), pytest.approx(cut_s))
    assert any("sound on" in one for one in result.warnings) == (overlap_s > 0.0)
    assert any("cut off" in one for one in result.warnings) == (cut_s > 0.0)
    begin, end = render._span_after(segment, result)
    assert end - begin == pytest.approx(min(overlap_s + RELEASE_S, spoken + RELEASE_S - 1.0), abs=1e-6)


def test_a_sentence_with_marks_is_cut_back_at_its_words(
    plan_of: Planner, voices: list[LetterVoice], tmp_path: Path
) -> None:
    text = SENTENCE.replace("boy,", "boy, (sighs)").replace("my father", "[nod] my father")
    run_batch(plan_of(text, per="file"), tmp_path / "marked")
    run_batch(plan_of(SENTENCE, per="file"), tmp_path / "plain")
    (marked,), (plain,) = (manifest(tmp_path / name)["outputs"] for name in ("marked", "plain"))
    for name in ("begin_s", "speech_s", "rate", "cut_s"):
        assert [cue[name] for cue in marked["cues"]] == [cue[name] for cue in plain["cues"]]


def test_the_words_that_are_cut_have_no_marks(plan_of: Planner, voices: list[LetterVoice], tmp_path: Path) -> None:
    marked = OVERLAP.replace("abcdefgh ijklmno.", "[nod] abcdefgh [smile] ijklmno pqrstuvwxyz abcdefgh.")
    run_batch(plan_of(marked, per="file"), tmp_path / "out")
    (output,) = manifest(tmp_path / "out")["outputs"]
    (lost,) = [warning for warning in output["warnings"] if "is not spoken" in warning]
    assert "[" not in lost
    assert "abcdefgh" in lost
