"""Sentences are bounded whatever the text, and nothing of it is lost."""

import random
import string
from itertools import islice

import pytest

from lexicon.dictionary import parse_dictionary
from lexicon.g2p import segments_by_rules
from lexicon.pronounce import spoken_form
from lexicon.sentence_ends import split_chunks
from lexicon.sentences import FIRST_SPOKEN_LETTERS, MAX_SPOKEN_LETTERS, Sentence, split_sentences
from lexicon.ssml import parse_marks, parse_ssml

chance = random.Random(1)
DIGITS = "".join(chance.choices("123456789", k=5000))
LETTERS = "".join(chance.choices(string.ascii_lowercase, k=5000))
MOST_VOICED = MAX_SPOKEN_LETTERS + 10  # letters; a last comma, and the spaces of long words
TEXTS = (
    (DIGITS, "en-us"), (DIGITS, "de"), (DIGITS, "cmn"), (LETTERS, "en-us"), (LETTERS, "de"), ("漢字" * 2000, "cmn"),
    ("щ" * 3000, "ru"), ("123456789 " * 200, "en-us"), ("½" * 1500, "en-us"), ("😀" * 2000, "en-us"),
    ("a" + "😀" * 20, "de"), ("$1" * 900, "en-us"), ("." * 5000 + "a", "en-us"), ("a-" * 2500, "en-us"),
    ("x'" * 2500, "en-us"), ("Donaudampfschifffahrt" * 100, "de"), ("1," * 2500, "fr-fr"), ("³" * 3000, "en-us"),
)  # fmt: skip


def voiced(sentence: Sentence) -> int:
    """Letters and given phones of a sentence; in other languages than English a digit counts as five letters."""
    text = "".join(phrase.text for phrase in sentence.utterances)
    given = [word for phrase in sentence.utterances for word in phrase.words]
    return len(text) + 4 * sum(map(str.isdigit, text)) + sum(len(word.segments) for word in given)


def test_a_text_without_ends_becomes_bounded_sentences() -> None:
    wrong = []
    for text, language in TEXTS:
        sentences = list(split_sentences(parse_marks(text, language), language))
        written = "".join("".join(phrase.source.split()) for one in sentences for phrase in one.utterances)
        is_complete = written.strip(".") == text.replace(" ", "").strip(".")
        is_joined = [after.first for after in sentences[1:]] == [one.last for one in sentences[:-1]]
        if max(map(voiced, sentences)) > MOST_VOICED or not is_complete or not is_joined:
            wrong.append((text[:10], language, [*map(voiced, sentences)]))
    assert not wrong


def test_a_divided_number_is_read_digit_by_digit_to_its_end() -> None:
    for n in (301, 599, 601, 650, 905, 5000):
        phrases = [one.utterances[0].text for one in split_sentences(parse_marks(DIGITS[:n]), "en-us")]
        spoken = " ".join(phrases).replace(",", "").split()
        assert len(spoken) == n
        assert not {"hundred", "thousand"} & set(spoken)


def test_given_phones_count_and_their_words_stay_whole() -> None:
    word = '<phoneme ph="' + "abab" * 100 + '">abcdefgh</phoneme>'
    for document in (f"<speak>{word * 20}</speak>", f"<speak>{' '.join([word] * 20)} x</speak>"):
        sentences = list(split_sentences(parse_ssml(document), "en-us"))
        assert max(map(voiced, sentences)) <= MOST_VOICED
        given = [word.text for one in sentences for phrase in one.utterances for word in phrase.words if word.segments]
        assert given == ["abcdefgh"] * 20


def test_pronunciations_of_the_user_count() -> None:
    own = parse_dictionary("a " + "T AH1 " * 20).entries
    sentences = list(split_sentences(parse_marks("a " * 149 + "a."), "en-us", own))
    assert len(sentences) > 5
    assert max(one.utterances[0].text.count("a") for one in sentences) * 40 <= MAX_SPOKEN_LETTERS


def test_words_longer_than_any_are_divided_before_the_voice() -> None:
    for letters, language in ((LETTERS[:450], "de"), ("абвг" * 100, "ru")):
        words = spoken_form(letters, language).split()
        assert "".join(words) == letters
        assert max(map(len, words)) == 100
        n_phones = sum(map(len, segments_by_rules(words, language)))
        assert n_phones > 0.8 * len(letters)  # espeak-ng reads 160 letters of a word
    longest = "Donaudampfschifffahrtselektrizitätenhauptbetriebswerkbauunterbeamtengesellschaft"
    assert spoken_form(longest, "de") == longest
    assert spoken_form("กขคงจ" * 40, "th") == "กขคงจ" * 40  # written without spaces
    assert spoken_form("7" * 21, "de") == "7" * 21
    assert spoken_form("7" * 22, "de") == "7 " * 21 + "7"


def test_an_address_stays_whole_and_a_longer_word_is_cut() -> None:
    address = "https://example.com/" + "a" * 500
    assert list(split_chunks(f"See {address} for more.", 300)) == ["See", address, "for more."]
    assert list(map(len, split_chunks("x" * 601, 300))) == [300, 301]


@pytest.mark.parametrize("unit", ["$1,234,567.89 ", "1234567890", "12345 ", "+1 (555) 123-4567 ", "👍🏽"])
def test_the_first_piece_is_short_also_where_everything_is_a_number(unit: str) -> None:
    text = (unit * 7000)[:100_000]
    first, second = islice(split_sentences(parse_marks(text), "en-us"), 2)
    assert len(first.utterances[0].text) <= FIRST_SPOKEN_LETTERS + 10
    assert len(second.utterances[0].text) <= MOST_VOICED
