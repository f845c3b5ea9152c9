"""Words with phones, stress, syllables and marks."""

import pytest

from lexicon.dictionary import parse_dictionary
from lexicon.errors import InputError
from lexicon.ipa import parse_ipa
from lexicon.nominal_durations import nominal_phones
from lexicon.phones import ARPABET, PHONES
from lexicon.pronounce import pronounce, split_syllables
from lexicon.sequence import SILENCE


def _arpabet(text: str) -> list[str]:
    return [" ".join(word.arpabet) for word in pronounce(text).words]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("We were away.", ["W IY2", "W ER0", "AH0 W EY1"]),
        ("the dog, the apple", ["DH AH0", "D AO1 G", "DH IY0", "AE1 P AH0 L"]),
        ("the FBI", ["DH IY0", "EH2 F B IY2 AY1"]),
        ("TVs", ["T IY2 V IY1 Z"]),
        ("NASA said", ["N AE1 S AH0", "S EH1 D"]),
        ("plan A", ["P L AE1 N", "EY1"]),
        ("A dog", ["AH0", "D AO1 G"]),
        ("STOP THAT NOW", ["S T AA1 P", "DH AE0 T", "N AW1"]),
        ("it's THE END", ["IH0 T S", "DH IY0", "EH1 N D"]),
        ("red-brown", ["R EH2 D B R AW1 N"]),
        ("an X-ray", ["AH0 N", "EH1 K S R EY2"]),
        ("Bob's", ["B AA1 B Z"]),
        ("$5", ["F AY1 V", "D AA1 L ER0 Z"]),
        ("to go to all", ["T AH0", "G OW2", "T UH0", "AO1 L"]),
        ("go to, go in.", ["G OW2", "T UW0", "G OW2", "IH1 N"]),
        ("that is", ["DH AE1 T", "IH0 Z"]),
        ("think that he", ["TH IH1 NG K", "DH AE0 T", "HH IY0"]),
        ("He can. Can he?", ["HH IY2", "K AE1 N", "K AE2 N", "HH IY0"]),
        ("I am an actor", ["AY2", "AH0 M", "AH0 N", "AE1 K T ER0"]),
    ],
)
def test_english_words(text: str, words: list[str]) -> None:
    assert _arpabet(text) == words


def test_words_that_no_dictionary_holds_get_phones_of_arpabet() -> None:
    spoken = pronounce("Wuggified blicketing florbs, zymurgical Qatari brillig!")
    assert set(spoken.phones) <= set(ARPABET.values())
    assert all(1 in word.stress for word in spoken.words)


def test_espeaks_linking_r_is_one_phone() -> None:
    assert pronounce("Qatari").words[0].phones.count("ɹ") == 1


def test_a_word_keeps_what_was_written_and_its_mark() -> None:
    spoken = pronounce("Pay $5, now!")
    assert [(w.text, w.source, w.mark) for w in spoken.words] == [
        ("Pay", "Pay", ""), ("five", "$5", ""), ("dollars", "$5", ","), ("now", "now", "!"),
    ]  # fmt: skip
    assert [w.pause_s for w in spoken.words] == [0.0, 0.0, 0.25, 0.5]


def test_the_user_wins() -> None:
    own = parse_dictionary("dog K AE1 T\nhaus /kat/\nthe DH IY1")
    assert pronounce("dog", dictionary=own).phones == ("k", "æ", "t")
    assert pronounce("Haus", "de", own).phones == ("k", "a", "t")
    assert pronounce("the dog", dictionary=own).words[0].arpabet == ("DH", "IY1")


@pytest.mark.parametrize(
    ("ipa", "is_english", "parts"),
    [
        ("ɛkstɹə", True, ["ɛk", "stɹə"]),
        ("æpəl", True, ["æ", "pəl"]),
        ("sɪŋɪŋ", True, ["sɪŋ", "ɪŋ"]),
        ("ætləs", True, ["æt", "ləs"]),
        ("stɹɛŋθs", True, ["stɹɛŋθs"]),
        ("fjutʃɚ", True, ["fju", "tʃɚ"]),
        ("alto", False, ["al", "to"]),
        ("patria", False, ["pa", "tri", "a"]),
        ("pst", True, ["pst"]),
    ],
)
def test_syllables(ipa: str, is_english: bool, parts: list[str]) -> None:
    segments = parse_ipa("_".join(ipa) if "tʃ" not in ipa else ipa)
    spans = split_syllables(segments, is_english=is_english)
    assert ["".join(s.phone for s in segments[first:last]) for first, last in spans] == parts


def test_ipa_shows_stress_and_syllables() -> None:
    assert [word.ipa for word in pronounce("hello pronunciation").words] == ["həˈloʊ", "pɹoʊˌnʌn.siˈeɪ.ʃən"]


@pytest.mark.parametrize(
    ("text", "language", "n_words"),
    [
        ("Schöne Grüße, 25 Äpfel.", "de", 4),
        ("C'est l'heure.", "fr-fr", 2),
        ("你好，世界。", "cmn", 3),
        ("The lot.", "en-gb", 2),
        ("नमस्ते, आप", "hi", 2),
    ],
)
def test_other_languages(text: str, language: str, n_words: int) -> None:
    spoken = pronounce(text, language)
    assert len(spoken.words) == n_words
    assert all(phone in PHONES for phone in spoken.phones)
    assert all(bool(word.arpabet) == language.startswith("en") for word in spoken.words)


@pytest.mark.parametrize("text", ["", " \n", "...!?", "“”", "()", "—"])
@pytest.mark.parametrize("language", ["en-us", "de"])
def test_text_without_a_word_is_refused(text: str, language: str) -> None:
    with pytest.raises(InputError, match="nothing to say"):
        pronounce(text, language)


def test_other_refusals() -> None:
    with pytest.raises(InputError, match="there is no language 'xq'"):
        pronounce("hello", "xq")
    with pytest.raises(InputError, match="'en-us' cannot read 世界"):
        pronounce("hello 世界")


def test_nominal_times_cover_words_and_pauses() -> None:
    spoken = pronounce("Pay $5, now!")
    phones, words = nominal_phones(spoken)
    assert [word.text for word in words] == ["Pay", "five", "dollars", "now"]
    assert tuple(p for p in phones.phones if p != SILENCE) == spoken.phones
    assert phones.phones[words[2].last] == SILENCE
    assert phones.phones[0] == phones.phones[-1] == SILENCE


@pytest.mark.parametrize(
    ("text", "marked"),
    [
        ("He has a Ph.D. in physics.", ["physics."]),
        ("He has a Ph.D. She left.", ["PHD.", "left."]),
        ("Insp. Morse met Adm. Lee.", ["Lee."]),
        ("On Jan. 3rd, see Fig. 2.", ["third,", "two."]),
        ("Mt. Everest and Op. 5.", ["five."]),
        ("We chose plan B. Then we left.", ["B.", "left."]),
    ],
)
def test_abbreviations_do_not_pause_and_sentence_ends_do(text: str, marked: list[str]) -> None:
    assert [word.text + word.mark for word in pronounce(text).words if word.mark] == marked
