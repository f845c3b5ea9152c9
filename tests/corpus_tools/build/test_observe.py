"""From a folder of recordings to a talker: refusals with reasons, resuming, any number of processes."""

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from corpus_tools.build_talker import build_talker
from corpus_tools.recordings.observe import STEPS_PER_VIDEO, observe
from corpus_tools.recordings.provenance import read_provenance
from corpus_tools.run_options import RunOptions
from lexicon.errors import DataError, InputError
from tests.conftest import SHARED
from tests.rendered_takes import ONLY_RENDERED
from tts2face.models.talker_file import read_talker
from tts2face.video.media import read_frames
from tts2face.video.streaming import StreamingTracker

CHILD = """
import sys
from pathlib import Path
from corpus_tools.run_options import RunOptions
from corpus_tools.recordings.observe import observe
observe(Path(sys.argv[1]), run_options=RunOptions(Path(sys.argv[2]), 1, Path(sys.argv[3])))
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory) -> Path:
    """Cache shared by the tests that do not examine tracking."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture
def max_missing_frames(takes: Path) -> int:
    """Frames by which an observation may be shorter than its video.

    The sound of real takes lasts as long as the picture. The sound of rendered takes ends with the speech, which may be
    within the last frame; a frame without sound is no part of an observation.
    """
    return 0 if SHARED in takes.parents else 1


def _muxed(source: Path, target: Path, kind: str) -> None:
    """Copy of a recording with only its pictures or only its sound."""
    import av

    with av.open(str(source)) as incoming, av.open(str(target), "w") as outgoing:
        stream = next(stream for stream in incoming.streams if stream.type == kind)
        copied = outgoing.add_stream_from_template(stream)
        for packet in incoming.demux(stream):
            if packet.dts is not None:
                packet.stream = copied
                outgoing.mux(packet)


def test_good_recordings_are_kept_and_bad_ones_refused_with_their_reason(few_takes, cache, face_model):
    clips = few_takes / "clips"
    good = clips / "bbaf2n.mkv"
    (clips / "empty.mkv").touch()
    (clips / "text.mkv").write_text("this is no film\n" * 50)
    (clips / "cut.mkv").write_bytes(good.read_bytes()[:50_000])
    _muxed(good, clips / "dumb.mkv", "video")
    _muxed(good, clips / "dark.mkv", "audio")
    shutil.copy(good, clips / "other.mkv")
    with (few_takes / "manifest.csv").open("a") as file:
        file.writelines(f"{name},bin blue at f two now\n" for name in ("empty", "text", "cut", "dumb", "dark"))
        file.write("other,yesterday my seventeen elephants remembered nothing whatsoever\n")
    seen = []
    found = observe(
        few_takes, run_options=RunOptions(cache, 1, face_model), on_progress=lambda done, of: seen.append((done, of))
    )
    assert [one.name for one in found.kept] == ["bbaf2n", "bbaf3s", "bbaf5a"]
    reasons = {refusal.name: refusal.reason for refusal in found.refused}
    expected = {
        "empty": "is empty (0 bytes)",
        "text": "cannot be read as video or sound",
        "cut": "is truncated",
        "dumb": "holds no sound",
        "dark": "holds no video",
        "other": "transcript",
    }
    assert set(reasons) == set(expected)
    assert [reasons[name] for name in expected if expected[name] not in reasons[name]] == []
    assert {of for _, of in seen} == {9 * STEPS_PER_VIDEO}
    assert [done for done, _ in seen] == sorted(done for done, _ in seen)
    assert seen[-1] == (9 * STEPS_PER_VIDEO, 9 * STEPS_PER_VIDEO)


def test_an_observation_is_on_one_clock(few_takes, cache, face_model, max_missing_frames):
    kept = observe(few_takes, run_options=RunOptions(cache, 1, face_model)).kept
    for observation in kept:
        n_in_video = len(list(read_frames(few_takes / "clips" / f"{observation.name}.mkv")))
        assert n_in_video - max_missing_frames <= len(observation.landmarks) <= n_in_video
    one = kept[0]
    n_frames = len(one.landmarks)
    assert one.landmarks.shape == (n_frames, 478, 3)
    assert one.head.shape == (n_frames, 6)
    assert one.intensity.shape == (n_frames,)
    assert [word.text for word in one.words] == ["bin", "blue", "at", "f", "two", "now"]
    assert one.phones.end <= n_frames / 25 + 1e-6
    eyes = np.linalg.norm(one.landmarks[:, 33] - one.landmarks[:, 263], axis=1)
    assert abs(eyes.mean() - 89) < 5  # mm of the canonical face
    loud = one.intensity[round(1.0 * 25) : round(2.0 * 25)].mean()
    assert loud > one.intensity[:12].mean() + 10  # dB: speech over silence


@ONLY_RENDERED
def test_processes_change_nothing(few_takes, tmp_path, face_model):
    alone = observe(few_takes, run_options=RunOptions(tmp_path / "a", 1, face_model)).kept
    together = observe(few_takes, run_options=RunOptions(tmp_path / "b", 2, face_model)).kept
    for one, other in zip(alone, together, strict=True):
        assert one.name == other.name
        np.testing.assert_array_equal(one.landmarks, other.landmarks)
        np.testing.assert_array_equal(one.phones.edges, other.phones.edges)


@ONLY_RENDERED
@pytest.mark.skipif(not hasattr(os, "killpg"), reason="needs POSIX signals")
def test_a_killed_run_is_resumed(few_takes, tmp_path, face_model, monkeypatch):
    kept = tmp_path / "cache"
    command = [sys.executable, "-c", CHILD, str(few_takes), str(kept), str(face_model)]
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    deadline = time.monotonic() + 60
    while not list(kept.glob("[!.]*.tracking")) and time.monotonic() < deadline and child.poll() is None:
        time.sleep(0.005)
    child.send_signal(signal.SIGKILL)
    child.wait()
    before = {path: path.stat().st_mtime_ns for path in kept.glob("[!.]*.tracking")}
    assert 0 < len(before) < 3
    tracked = []
    sights = StreamingTracker.track
    monkeypatch.setattr(StreamingTracker, "track", lambda *args: tracked.append(1) or sights(*args))
    assert len(observe(few_takes, run_options=RunOptions(kept, 1, face_model)).kept) == 3
    assert len(tracked) == 3 - len(before)
    assert all(path.stat().st_mtime_ns == stamp for path, stamp in before.items())


@ONLY_RENDERED
def test_a_damaged_part_of_the_cache_is_made_again(few_takes, tmp_path, face_model):
    run_options = RunOptions(tmp_path / "cache", 1, face_model)
    first = observe(few_takes, run_options=run_options).kept
    for path in (tmp_path / "cache").iterdir():
        path.write_bytes(path.read_bytes()[:100])
    again = observe(few_takes, run_options=run_options).kept
    for one, other in zip(first, again, strict=True):
        np.testing.assert_array_equal(one.landmarks, other.landmarks)


@ONLY_RENDERED
def test_a_talker_is_built_with_its_provenance(few_takes, cache, tmp_path, face_model):
    (few_takes / "provenance.json").write_text('{"licence": "CC BY 4.0", "language": "en-gb"}')
    (few_takes / "clips" / "empty.mkv").touch()
    out = tmp_path / "made.talker"
    stages_seen: dict[str, tuple[int, int]] = {}

    def stages(name):
        stages_seen[name] = (0, 1)
        return lambda done, of: stages_seen.update({name: (done, of)})

    run_options = RunOptions(cache, 1, face_model)
    built = build_talker(
        few_takes, out, name="s1", run_options=run_options, created="2000-01-01", base="none", stages=stages
    )
    assert stages_seen["reading recordings"] == (400, 400)
    assert list(stages_seen) == ["reading recordings", "learning phone network"]  # too few recordings for audio maps
    n_frames = sum(len(one.landmarks) for one in observe(few_takes, run_options=run_options).kept)
    assert (built.n_kept, [refusal.name for refusal in built.refused]) == (3, ["empty"])
    assert built.minutes == pytest.approx(n_frames / 25 / 60, rel=1e-12)
    talker = read_talker(out)
    assert talker.metadata["name"] == "s1"
    assert talker.metadata["licence"] == "CC BY 4.0"
    assert talker.metadata["attribution"] == "not stated"
    assert talker.metadata["command"] == "tts2face corpus build recordings --name s1 --out made.talker"
    assert talker.metadata["refused"][0][0] == "empty"


def test_nothing_is_written_when_every_recording_is_refused(tmp_path, face_model):
    folder = tmp_path / "recordings"
    folder.mkdir()
    (folder / "a.mkv").touch()
    with pytest.raises(InputError, match="no recording could be used"):
        build_talker(folder, tmp_path / "x.talker", run_options=RunOptions(tmp_path / "cache", 1, face_model))
    assert not (tmp_path / "x.talker").exists()


def test_a_provenance_with_other_fields(tmp_path):
    (tmp_path / "p.json").write_text('{"license": "CC0"}')
    with pytest.raises(DataError, match="fields out of name, language, sources, licence, attribution"):
        read_provenance(tmp_path / "p.json", must_exist=True)


def test_a_missing_provenance_file(tmp_path):
    assert read_provenance(tmp_path / "p.json", must_exist=False) == {}
    with pytest.raises(DataError, match=r"p\.json cannot be read \(No such file"):
        read_provenance(tmp_path / "p.json", must_exist=True)
    (tmp_path / "p.json").write_text('{"name": ' + "[" * 100_000)
    with pytest.raises(DataError, match=r"p\.json is nested too deep"):
        read_provenance(tmp_path / "p.json", must_exist=True)


@ONLY_RENDERED
def test_no_job(few_takes, tmp_path):
    with pytest.raises(InputError, match="jobs must be 1 or more"):
        observe(few_takes, run_options=RunOptions(tmp_path, -1))
