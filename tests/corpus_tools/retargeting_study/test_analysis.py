"""The study of retargeting on a made recording with known scores."""

import csv
import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from corpus_tools.studies.retargeting.analysis import (
    SCORES,
    MimickedRecording,
    MouthMotion,
    PhoneScores,
    RetargetingStudy,
    bilabial_gaps,
    mouth_motion,
    phone_scores,
)
from corpus_tools.studies.retargeting.page import retargeting_page
from corpus_tools.studies.retargeting.write import REPORT
from lexicon.sequence import SILENCE, PhoneSequence
from tests.corpus_tools.conftest import made_observation
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER

MOTION = MouthMotion(0.99, 0.95, 1.02, 1.0, 3)


def made_recording() -> MimickedRecording:
    """Silence, /b/ and /i/ at 25 frames/s; the face reads .1 more jawOpen than the person in every frame."""
    phones = PhoneSequence([SILENCE, "b", "i", SILENCE], [0.0, 0.4, 0.8, 1.6, 2.4])
    observation = replace(made_observation("a", 3), phones=phones)
    landmarks = observation.landmarks.astype(np.float64)
    landmarks[:, list(INNER_LIP_UPPER), 1] = 1.0
    landmarks[:, list(INNER_LIP_LOWER), 1] = 0.0
    landmarks[15, list(INNER_LIP_LOWER), 1] = 0.9  # the lips are nearest in frame 15, within /b/
    landmarks[25:30, list(INNER_LIP_LOWER), 1] = -6.0
    person = np.tile(np.arange(len(landmarks))[:, None] / 100, (1, len(SCORES)))
    face = person.copy()
    face[:, 0] += 0.1
    return MimickedRecording(replace(observation, landmarks=landmarks.astype(np.float32)), person, face, landmarks)


def made_study(n_tokens: int = 5) -> RetargetingStudy:
    one = np.linspace(0.0, 0.6, len(SCORES))
    near = PhoneScores("i", n_tokens, one, one + 0.05)
    far = PhoneScores("b", n_tokens, one, one + np.where(np.arange(len(SCORES)) == 1, -0.07, 0.0))
    return RetargetingStudy("head", 2, 150, (near, far, PhoneScores("w", 2, one, one + 0.5)), MOTION)


def test_scores_are_read_at_the_middle_of_phones() -> None:
    found = {row.phone: row for row in phone_scores([made_recording()])}
    assert set(found) == {"b", "i"}
    assert found["b"].n_tokens == 1
    assert found["b"].person == pytest.approx(0.15)  # 0.6 s
    assert found["i"].person == pytest.approx(0.30)  # 1.2 s
    assert found["i"].face - found["i"].person == pytest.approx([0.1] + [0] * (len(SCORES) - 1))


def test_a_mouth_that_moves_alike_has_full_marks() -> None:
    motion = mouth_motion([made_recording()])
    assert (motion.r_opening, motion.range_ratio) == pytest.approx((1.0, 1.0))
    assert (motion.closed, motion.n_bilabials) == (1.0, 1)


def test_bilabials_are_judged_where_the_person_closes() -> None:
    one = made_recording()
    assert bilabial_gaps(one) == pytest.approx([0.1])
    parted = one.landmarks.copy()
    parted[15, list(INNER_LIP_LOWER), 1] = -1.0
    opened = replace(one, landmarks=parted)
    assert bilabial_gaps(opened) == pytest.approx([2.0])
    assert mouth_motion([opened]).closed == 0.0


def test_only_frequent_phones_are_judged() -> None:
    study = made_study()
    assert study.differences.shape == (2, len(SCORES))
    assert study.n_missed == 1
    assert made_study(n_tokens=4).differences.shape == (0, len(SCORES))


@pytest.mark.needs("matplotlib")
def test_the_page_names_what_is_missed_and_loads_nothing() -> None:
    html = retargeting_page(made_study())
    assert "1 of 14 differences exceed 0.06" in html
    assert html.count("beyond the tolerance") == 1
    assert "Phones with fewer tokens: w 2." in html
    assert all(f"<h3>{score}</h3>" in html for score in SCORES)
    assert html.count("<svg") == html.count("</svg>") == 1
    assert "<title>b: 0.10 -&gt; 0.03</title>" in html
    assert not re.search(r"http|<(script|link|img)|url\((?!#)|@import|\bnan\b", html)


def test_a_page_without_frequent_phones_has_no_plot() -> None:
    html = retargeting_page(made_study(n_tokens=1))
    assert "<svg" not in html
    assert "0 of 0 differences" in html


@pytest.mark.needs("matplotlib")
def test_tables_hold_every_phone_and_score() -> None:
    study = made_study()
    rows = list(csv.DictReader(io.StringIO(REPORT.formats[".csv"](study).decode())))
    assert len(rows) == 3 * len(SCORES)
    assert rows[len(SCORES) + 1] == {
        "phone": "b", "arpabet": "B", "tokens": "5", "score": "mouthPucker", "person": "0.1000", "face": "0.0300",
        "difference": "-0.0700",
    }  # fmt: skip
    content = json.loads(REPORT.formats[".json"](study))
    assert (content["judged"], content["missed"], content["recordings"]) == (14, 1, 2)
    assert content["phones"][1]["face"]["mouthPucker"] == 0.03
    silent = replace(study, motion=MouthMotion(0.9, 0.9, 1.0, float("nan"), 0))
    assert json.loads(REPORT.formats[".json"](silent))["motion"]["closed"] is None
    assert "none spoken" in retargeting_page(silent)


@pytest.mark.needs("matplotlib")
def test_the_plot_is_a_picture() -> None:
    assert REPORT.formats[".png"](made_study()).startswith(b"\x89PNG")
