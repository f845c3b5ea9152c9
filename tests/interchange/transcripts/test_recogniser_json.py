"""JSON of recognisers and aligners: words with their times, segments, and what is missing."""

import json

import pytest

from lexicon.errors import DataError
from tts2face.interchange.transcripts.reader import find_reader, read_transcript
from tts2face.interchange.transcripts.written_words import read_written_words

WORDS = [
    {"word": " bin", "start": 0.5, "end": 0.8, "probability": 0.9}, {"word": " red.", "start": 0.8, "end": 1.2},
]  # fmt: skip
SEGMENTS = [
    {"id": 0, "seek": 0, "start": 0.5, "end": 1.2, "text": " bin red."}, {"start": 2, "end": 3, "text": " By k."},
]  # fmt: skip
GENTLE = [
    {"case": "success", "word": "bin", "alignedWord": "bin", "start": 0.5, "end": 1.0},
    {"case": "not-found-in-audio", "word": "red"},
    {"case": "success", "word": "now", "start": 1.5, "end": 2.0},
]


@pytest.fixture
def write(tmp_path):
    """File with a content as JSON."""

    def written(content, name="v.json"):
        (tmp_path / name).write_text(json.dumps(content), encoding="utf-8")
        return tmp_path / name

    return written


@pytest.mark.parametrize(
    "content",
    [
        {"text": " bin red.", "segments": [SEGMENTS[0] | {"words": WORDS}], "language": "en"},
        {"task": "transcribe", "duration": 2.0, "text": "bin red.", "words": WORDS, "segments": SEGMENTS[:1]},
        {"result": WORDS, "text": "bin red."},
        {"transcript": "bin red.", "words": WORDS},
        {"segments": [{"start": 0.5, "end": 1.2, "text": "bin red.", "words": [
            {"text": "bin", "start": 0.5, "end": 0.8}, {"text": "red.", "start": 0.8, "end": 1.2}]}]},
    ],
)  # fmt: skip
@pytest.mark.parametrize("name", ["v.json", "v.txt"])
def test_words_have_their_times(content, name, write):
    found = read_transcript(write(content, name))
    assert [(word.text, word.start, word.end) for word in found.words] == [("bin", 0.5, 0.8), ("red.", 0.8, 1.2)]


def test_segments_share_their_times(write):
    found = read_transcript(write({"text": "", "segments": SEGMENTS}))
    assert found.text == "bin red. By k."
    assert (found.words[0].start, found.words[1].end, found.words[3].end) == (0.5, 1.2, 3.0)


def test_offsets_are_milliseconds(write):
    rows = [{"timestamps": {"from": "00:00:00,500"}, "offsets": {"from": 500, "to": 2000}, "text": " bin red"}]
    found = read_transcript(write({"systeminfo": "", "transcription": rows}))
    assert (found.text, found.words[0].start, found.words[1].end) == ("bin red", 0.5, 2.0)


def test_words_without_times_lie_between_the_others(write):
    found = read_transcript(write({"transcript": "", "words": GENTLE}))
    assert found.text == "bin red now"
    assert 1.0 < found.words[1].start < found.words[1].end < 1.5
    assert "2 times that v.json lacks are interpolated between others" in found.notes


@pytest.mark.parametrize(
    "content",
    [{}, [], {"words": ["bin"]}, {"segments": 5}, {"words": [{"word": "a"}]}, {"frames": [{"start": 0, "end": 1}]},
     {"result": [{"start": True, "end": None, "word": "a"}]}],
)  # fmt: skip
def test_other_json_is_no_transcript(content, write):
    path = write(content)
    assert find_reader(path) is None
    assert read_written_words(path) is None
    with pytest.raises(DataError, match="is no transcript with times"):
        read_transcript(path)
