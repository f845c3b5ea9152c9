"""CTM, STM, label files of HTK and xlabel, words of TIMIT: six words with their times."""

import re

import pytest

from lexicon.errors import DataError
from tts2face.interchange.transcripts.reader import find_reader, find_reader_of_text

WORDS = (("bin", 0.55, 0.75), ("red", 0.75, 1.05), ("now", 1.9, 2.3))
CTM = "".join(f"v A {start:.2f} {end - start:.2f} {word} 0.98\n" for word, start, end in WORDS)
HTK = "0 5500000 sil\n" + "".join(f"{round(start * 1e7)} {round(end * 1e7)} {word}\n" for word, start, end in WORDS)
TIMIT = "".join(f"{round(start * 16000)} {round(end * 16000)} {word}\n" for word, start, end in WORDS)
XLABEL = "separator ;\nnfields 1\n#\n0.55 125 pau\n0.75 125 bin\n1.05 125 red\n1.9 125 pau\n2.3 125 now\n"


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("v.ctm", ";; by a recogniser\n" + CTM),
        ("v.ctm", CTM + CTM.replace("v A", "other A").replace("red", "blue")),
        ("other.ctm", CTM),
        ("v.ctm", CTM.replace("v A 0.75", "v A * * <ALT_BEGIN>\nv A 0.75") + "v A 2.30 0.10 <eps>\n"),
        ("v.lab", HTK),
        ("v.lab", HTK.replace("sil", "sil -201.5")),
        ("v.lab", "".join(f"{start} {end} {word}\n" for word, start, end in WORDS)),
        ("v.lab", XLABEL),
        ("v.wrd", TIMIT),
    ],
)
def test_words_with_their_times(name, content, read):
    found = read(name, content).words
    assert [word.text for word in found] == [word for word, _, _ in WORDS]
    for word, (_, start, end) in zip(found, WORDS, strict=True):
        assert (word.start, word.end) == pytest.approx((start, end), abs=1e-9)


def test_of_alternatives_the_first_is_read(read):
    content = "v A * * <ALT_BEGIN>\nv A 0 1 bin\nv A * * <ALT>\nv A 0 1 been\nv A * * <ALT_END>\nv A 1 1 red\n"
    assert read("v.ctm", content).text == "bin red"


def test_units_that_are_not_written_are_said(read):
    assert read("v.lab", HTK).notes[0] == "times of v.lab are read in units of 100 ns, as of HTK"
    assert read("v.wrd", TIMIT).notes == ("times of v.wrd are read as samples of 16 kHz",)


def test_channels_and_speakers_are_tiers(read):
    both = CTM + CTM.replace("v A", "v B").replace("red", "blue")
    found = read("v.ctm", both)
    assert found.text == "bin red now"
    assert "'B' also has words" in found.notes[0]
    assert read("v.ctm", both, "B").text == "bin blue now"


def test_utterances_of_stm(read):
    content = (
        ";; comment\nv 1 anna 0.00 0.50 <o,f0,male> inter_segment_gap\n"
        "v 1 anna 0.50 1.10 <o,f0,male> {bin / been / @} (red) (%hesitation)\nv 1 anna 1.90 2.30 now\n"
    )
    found = read("v.stm", content)
    assert found.text == "bin red now"
    assert (found.words[0].start, found.words[1].end, found.words[2].start) == (0.5, 1.1, 1.9)


def test_words_beside_phones_of_htk(read):
    rows = (
        "0 5000000 sil -2.5 SENT-START\n5000000 6000000 b -3.1 bin\n6000000 7000000 ih -2.2\n7000000 9000000 n -1.0\n"
    )
    rows += "9000000 12000000 n -3.0 now\n12000000 15000000 aw -2.0\n"
    found = read("v.lab", rows)
    assert [(word.text, round(word.start, 6), round(word.end, 6)) for word in found.words] == [
        ("bin", 0.5, 0.9), ("now", 0.9, 1.5),
    ]  # fmt: skip


@pytest.mark.parametrize(
    "rows",
    [
        "0 50 sil SIL\n50 60 b bin\n60 70 ih\n70 90 n\n90 100 n now\n100 150 aw\n150 160 sil SIL\n",
        "0 50 s2 -1 sil -1 SIL -1\n50 60 s2 -1 b -1 bin -2\n60 90 s3 -1\n90 150 s2 -1 n -1 now -3\n150 160 s2 -1 sil "
        "-1 SIL -2\n",
    ],
)
def test_words_beside_phones_and_states_of_htk(rows, read):
    units = re.sub(r"^(\d+) (\d+)", lambda match: f"{match[1]}00000 {match[2]}00000", rows, flags=re.MULTILINE)
    found = read("v.lab", units)
    assert [(word.text, round(word.start, 6), round(word.end, 6)) for word in found.words] == [
        ("bin", 0.5, 0.9), ("now", 0.9, 1.5),
    ]  # fmt: skip


def test_numbers_that_are_said_are_no_scores(read):
    assert read("v.lab", "0.5 1.5 place red at f 2\n1.5 2.5 set blue by k 9\n").text.endswith("set blue by k 9")
    assert read("v.txt", "0.5\t1.5\tplace red at f 2\n1.5\t2.5\tset blue by k 9\n").text.startswith("place red at f 2")
    assert find_reader_of_text("1 2 buckle my shoe\n3 4 knock at the door\n") is None


@pytest.mark.parametrize(
    ("said", "words"),
    [
        ("THE(2) cat READ(3)", "THE cat READ"),
        ("A(2) {cat / cats / @} it's(2)", "A cat it's"),
        ("(the(2)) f(2) GOING_TO go", "the f2 GOING TO go"),
    ],
)
def test_further_pronunciations_and_compounds_of_recognisers_are_words(said, words, read):
    assert read("v.stm", f"v 1 anna 0.50 1.10 {said}\n").text == words


def test_plain_words_of_a_label_file_are_text(tmp_path):
    (tmp_path / "v.lab").write_text("bin red by k seven now\n")
    assert find_reader(tmp_path / "v.lab") is None


def test_a_prompt_of_timit_has_a_span(read):
    found = read("v.txt", "0 46797 She had your dark suit.\n")
    assert found.text == "She had your dark suit."
    assert found.words[-1].end == 46797 / 16000


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("v.ctm", "v A 0.5 bin\n", r"line 1: 'v A 0.5 bin' is not file, channel, start, length and word"),
        ("v.ctm", CTM.replace("v A", "a A") + CTM.replace("v A", "b A"), "has the words of a, b ..., and not of v"),
        ("v.stm", "v 1 anna start end hello\n", "line 1: .* is not file, channel, speaker, start, end and words"),
        ("v.lab", "#!MLF!#\n\"*/a.lab\"\n0 1 a\n.\n", "is a master label file of many recordings"),
        ("v.lab", "0 80 bin\n80 160 red\n", "neither seconds nor units of 100 ns"),
("v.lab", "0 900000 b\n900000 1600000 ih\n1600000 2400000 n\n", "seems to hold phones and no words"),
        ("v.wrd", "0 x bin\n", "is not start, end and word in samples"),
    ],
)  # fmt: skip
def test_what_cannot_be_read_is_refused(name, content, reason, read):
    with pytest.raises(DataError, match=reason):
        read(name, content)
