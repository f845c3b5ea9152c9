"""Phones, words and visemes: times, tables, and files read back by json, xml, csv, Praat, praatio and OpenFaceFX."""

import csv
import json
from dataclasses import replace
from itertools import pairwise
from xml.etree import ElementTree

import numpy as np
import parselmouth
import pytest
from parselmouth.praat import call

import tts2face
from lexicon.errors import InputError
from lexicon.phones import PHONES
from lexicon.sequence import PhoneSequence
from tests.interchange.exports.made import PHONES as MADE_PHONES
from tests.interchange.exports.made import WORDS, made_clip, made_stream, silent_clip
from tests.packages import package
from tts2face.interchange.exports.labels import Label
from tts2face.interchange.exports.visemes import INVENTORIES, OCULUS, viseme_labels, viseme_table
from tts2face.types import Clip, Speech, concatenate_clips

pytestmark = pytest.mark.formats


def lines(path):
    return [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]


@pytest.mark.parametrize("inventory", list(INVENTORIES))
def test_every_phone_has_visemes_of_the_inventory(inventory):
    table = viseme_table(inventory)
    assert set(table) == set(PHONES)
    used = {viseme for visemes in table.values() for viseme in visemes}
    assert used == set(INVENTORIES[inventory])
    assert all(1 <= len(visemes) <= 2 for visemes in table.values())


@pytest.mark.parametrize(
    ("phone", "oculus", "azure", "rhubarb"),
    [
        ("sil", "sil", "0", "X"), ("m", "PP", "21", "A"), ("v", "FF", "18", "G"), ("ð", "TH", "17", "B"),
        ("θ", "TH", "19", "B"), ("t", "DD", "19", "B"), ("k", "kk", "20", "B"), ("tʃ", "CH", "16", "B"),
        ("z", "SS", "15", "B"), ("l", "nn", "14", "H"), ("ɹ", "RR", "13", "E"), ("h", "kk", "12", "C"),
        ("aɪ", "aa I", "11", "D B"), ("ɔɪ", "O I", "10", "E B"), ("aʊ", "aa U", "9", "D E"), ("oʊ", "O U", "8", "F E"),
        ("w", "U", "7", "F"), ("j", "I", "6", "B"), ("ɝ", "RR", "5", "E"), ("ɛ", "E", "4", "C"), ("ɔ", "O", "3", "E"),
        ("ɑ", "aa", "2", "D"), ("ə", "E", "1", "C"), ("y", "U", "7", "F"), ("ã", "aa", "2", "D"),
    ],
)  # fmt: skip
def test_visemes_are_those_of_the_published_tables(phone, oculus, azure, rhubarb):
    found = [" ".join(viseme_table(inventory)[phone]) for inventory in ("oculus", "azure", "rhubarb")]
    assert found == [oculus, azure, rhubarb]


def test_a_diphthong_is_divided_in_the_middle():
    assert list(viseme_labels(Label("aɪ", 1.0, 1.5), "oculus")) == [Label("aa", 1.0, 1.25), Label("I", 1.25, 1.5)]
    with pytest.raises(InputError, match="'xx' is not a phone"):
        list(viseme_labels(Label("xx", 0, 1), "azure"))


def test_oculus_lines(tmp_path):
    clip = made_clip()
    tts2face.export(clip, tmp_path / "a.oculus.jsonl")
    read = lines(tmp_path / "a.oculus.jsonl")
    assert [one["viseme"] for one in read] == ["sil", "PP", "aa", "I", "RR", "DD", "SS", "sil"]
    assert [OCULUS[one["id"]] for one in read] == [one["viseme"] for one in read]
    assert [one["phone"] for one in read] == ["sil", "p", "aɪ", "aɪ", "ʁ", "ts", "ts", "sil"]
    assert all(one["end"] == other["start"] for one, other in pairwise(read))
    assert (read[0]["start"], read[-1]["end"]) == (0, clip.speech.waveform.duration)
    assert read[1]["start"] == pytest.approx(clip.speech.phones.edges[1], abs=1e-9)


def test_azure_lines_count_ticks_of_100_ns(tmp_path):
    clip = made_clip()
    tts2face.export(clip, tmp_path / "a.azure.jsonl")
    read = lines(tmp_path / "a.azure.jsonl")
    assert [one["viseme_id"] for one in read] == [0, 21, 11, 13, 19, 15, 0]
    assert read[1]["audio_offset"] == round(clip.speech.phones.edges[1] * 1e7)
    ends = [one["audio_offset"] + one["duration"] for one in read]
    assert ends[:-1] == [one["audio_offset"] for one in read[1:]]
    assert ends[-1] == 10_000_000


def test_visemes_of_a_stream_are_those_of_the_whole(tmp_path):
    pieces = made_stream(3, 29, 30000 / 1001)
    tts2face.export(pieces, tmp_path / "a.oculus.jsonl")
    tts2face.export(concatenate_clips(pieces), tmp_path / "b.oculus.jsonl")
    a, b = lines(tmp_path / "a.oculus.jsonl"), lines(tmp_path / "b.oculus.jsonl")
    assert [one["viseme"] for one in a] == [one["viseme"] for one in b]
    assert [one["viseme"] for one in a].count("sil") == 4  # silences at the joints are one
    for name in ("start", "end"):
        assert np.allclose([one[name] for one in a], [one[name] for one in b], rtol=0, atol=1e-8)


def test_rhubarb_files_hold_the_same_cues(tmp_path):
    paths = [tmp_path / f"Größe.rhubarb.{kind}" for kind in ("json", "tsv", "xml")]
    tts2face.export(made_clip(), paths)
    content = json.loads(paths[0].read_text(encoding="utf-8"))
    assert content["metadata"] == {"soundFile": "Größe.wav", "duration": 1.0}
    cues = content["mouthCues"]
    assert [cue["value"] for cue in cues] == ["X", "A", "D", "B", "X"]  # aɪ ends, ʁ and ts are B
    assert [cue["start"] for cue in cues] == [0, 0.1, 0.25, 0.38, 0.8]
    assert all(cue["end"] == after["start"] for cue, after in pairwise(cues))
    table = list(csv.reader(paths[1].read_text(encoding="utf-8").splitlines(), delimiter="\t"))
    assert [(float(start), shape) for start, shape in table[:-1]] == [(cue["start"], cue["value"]) for cue in cues]
    assert table[-1] == ["1.00", "X"]
    root = ElementTree.parse(paths[2]).getroot()
    assert root.find("metadata/soundFile").text == "Größe.wav"
    assert root.find("metadata/duration").text == "1.00"
    found = [
        {"start": float(cue.get("start")), "end": float(cue.get("end")), "value": cue.text}
        for cue in root.iterfind("mouthCues/mouthCue")
    ]
    assert found == cues


def test_short_silences_do_not_close_the_mouth(tmp_path):
    clip = made_clip()
    phones = PhoneSequence(("sil", "ɑ", "sil", "ɑ", "p", "sil"), [0, 0.3, 0.5, 0.55, 0.8, 0.804, 1.0])
    spoken = Clip(clip.motion, clip.head, Speech(clip.speech.waveform, phones, ()))
    tts2face.export(spoken, tmp_path / "a.rhubarb.json")
    cues = json.loads((tmp_path / "a.rhubarb.json").read_text())["mouthCues"]
    assert [(cue["start"], cue["value"]) for cue in cues] == [(0, "X"), (0.3, "D"), (0.8, "X")]  # /p/ lasts 4 ms


def test_praat_and_praatio_read_the_textgrid(tmp_path):
    textgrids = package("praatio.textgrid")
    pieces = made_stream(2)
    tts2face.export(pieces, tmp_path / "a.TextGrid")
    grid = parselmouth.read(str(tmp_path / "a.TextGrid"))
    count = int(call(grid, "Get number of intervals", 2))
    phones = [call(grid, "Get label of interval", 2, at) for at in range(1, count + 1)]
    assert phones == [*MADE_PHONES[:-1], *MADE_PHONES]
    assert call(grid, "Get end time of interval", 2, count) == pytest.approx(2.0, abs=1e-9)
    read = textgrids.openTextgrid(str(tmp_path / "a.TextGrid"), includeEmptyIntervals=False)
    words = read.getTier("words").entries
    assert [word.label for word in words] == [word.text for word in WORDS] * 2
    edges = pieces[0].speech.phones.edges
    assert np.allclose([words[0].start, words[0].end], [edges[1], edges[3]], rtol=0, atol=1e-9)
    assert np.allclose([words[3].start, words[3].end], 1 + np.array([edges[3], edges[5]]), rtol=0, atol=1e-9)


def test_idle_animation_has_labels_of_silence(tmp_path):
    paths = [tmp_path / f"a{suffix}" for suffix in (".TextGrid", ".rhubarb.json", ".azure.jsonl", ".oculus.jsonl")]
    tts2face.export(silent_clip(), paths)
    grid = parselmouth.read(str(paths[0]))
    assert call(grid, "Get label of interval", 1, 1) == ""
    assert json.loads(paths[1].read_text())["mouthCues"] == [{"start": 0.0, "end": 1.0, "value": "X"}]
    assert [one["viseme_id"] for one in lines(paths[2])] == [0]
    assert [one["viseme"] for one in lines(paths[3])] == ["sil"]


def test_lines_of_words_tell_how_sure_they_are(tmp_path):
    clip = made_clip()
    sure, doubtful = clip.speech.words
    speech = replace(clip.speech, words=(sure, replace(doubtful, confidence=0.25)))
    tts2face.export([clip, replace(clip, speech=speech)], tmp_path / "a.words.jsonl")
    read = lines(tmp_path / "a.words.jsonl")
    assert [(one["word"], one["confidence"]) for one in read] == [
        *((w.text, 1) for w in WORDS),
        (WORDS[0].text, 1),
        (WORDS[1].text, 0.25),
    ]
    edges = clip.speech.phones.edges
    assert (read[3]["start"], read[3]["end"]) == pytest.approx((1 + edges[3], 1 + edges[5]), abs=1e-9)
