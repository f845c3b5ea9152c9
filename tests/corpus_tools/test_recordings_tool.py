"""Answers of the tool that checks takes."""

from corpus_tools.recordings.limits import OUT_OF_SYNC, REFUSAL, UNUSABLE, WARNING, Finding
from corpus_tools.tools import recordings
from tests.processes.answered import answered


class KnownChecker:
    """A checker with known findings."""

    def __init__(self, *findings: Finding) -> None:
        self._findings = findings

    def check(self, recording):
        return self._findings


def asked(tmp_path, monkeypatch, *findings):
    video = tmp_path / "take-0001.webm"
    video.write_bytes(b"video")
    monkeypatch.setattr(recordings, "_checker", lambda cache: KnownChecker(*findings))
    order = {"video": str(video), "text": "Hello there.", "cache": str(tmp_path / "cache")}
    (answer,) = answered(recordings.HANDLERS["check"], order)
    return answer.content


def test_findings_say_what_a_person_in_front_of_the_camera_can_do(tmp_path, monkeypatch):
    words = Finding(REFUSAL, "fit", "the sound does not match the transcript; correct the words", 0.4, 0.6)
    broken = Finding(REFUSAL, UNUSABLE, f"{tmp_path}/take-0001.webm is empty; record it again")
    found = asked(tmp_path, monkeypatch, words, broken)
    assert [one["message"] for one in found["findings"]] == [
        "the sound does not match the prompt; read exactly what is shown",
        "take-0001.webm is empty; record it again",
    ]
    assert found["key"]


def test_a_take_is_not_blamed_for_being_short(tmp_path, monkeypatch):
    short = Finding(WARNING, OUT_OF_SYNC, "5.0 s are too short to tell; record 12 s or more")
    assert asked(tmp_path, monkeypatch, short)["findings"] == []
    late = Finding(REFUSAL, OUT_OF_SYNC, "sound and picture are out of sync")
    assert len(asked(tmp_path, monkeypatch, late, short)["findings"]) == 1
