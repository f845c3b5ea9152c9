"""Sentences are bounded whatever the text, and nothing of it is lost."""

import random
import string
from itertools import islice

import pytest

from lexicon.chunks import split_chunks
from lexicon.dictionary import parse_dictionary
from lexicon.errors import InputError
from lexicon.g2p import segments_by_rules
from lexicon.marked_text import PauseMark
from lexicon.normalize import spoken_form
from lexicon.sentence_length import FIRST_SPOKEN_LETTERS, LETTERS_PER_S, MAX_SPOKEN_LETTERS, check_silence
from lexicon.sentences import Sentence, split_sentences
from lexicon.ssml import parse_ssml
from lexicon.text_marks import parse_marks

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
SLOW = '<prosody rate="50%">{}</prosody>'
PAUSED = (
    "a<break time='10s'/>" * 1000, "word <break time='9s'/>" * 1000, "Yes. <break time='10s'/>" * 1000,
    "a<break time='100ms'/>" * 4000, SLOW.format("word " * 3000), SLOW.format("1" * 900),
    '<prosody rate="50%">a<break time="10s"/></prosody>' * 500,
    "<phoneme ph='a'>a</phoneme><break time='10s'/>" * 300, "漢字<break time='10s'/>" * 500,
)  # fmt: skip


def voiced(sentence: Sentence) -> int:
    """Letters and given phones of a sentence; in other languages than English a digit counts as five letters."""
    text = "".join(phrase.text for phrase in sentence.utterances)
    given = [word for phrase in sentence.utterances for word in phrase.words]
    return len(text) + 4 * sum(map(str.isdigit, text)) + sum(len(word.segments) for word in given)


def test_a_text_without_ends_becomes_bounded_sentences() -> None:
    wrong = []
    for text, language in TEXTS:
        sentences = list(split_sentences(parse_marks(text, language, "plain"), language))
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
    assert spoken_form("7" * 21, "sv") == "7" * 21
    assert spoken_form("7" * 22, "sv") == "7 " * 21 + "7"


def test_an_address_stays_whole_and_a_longer_word_is_cut() -> None:
    address = "https://example.com/" + "a" * 500
    assert list(split_chunks(f"See {address} for more.", 300)) == ["See", address, "for more."]
    assert list(map(len, split_chunks("x" * 601, 300))) == [300, 301]


@pytest.mark.parametrize("unit", ["$1,234,567.89 ", "1234567890", "12345 ", "+1 (555) 123-4567 ", "👍🏽"])
def test_the_first_piece_is_short_also_where_everything_is_a_number(unit: str) -> None:
    text = (unit * 7000)[:100_000]
    first, second = islice(split_sentences(parse_marks(text, markup="plain"), "en-us"), 2)
    assert len(first.utterances[0].text) <= FIRST_SPOKEN_LETTERS + 10
    assert len(second.utterances[0].text) <= MOST_VOICED


def letters_of_silence(sentence: Sentence) -> float:
    """Silence between the phrases of a sentence, in letters that are spoken in its time."""
    return LETTERS_PER_S * sum(phrase.pause or 0.0 for phrase in sentence.utterances[:-1])


@pytest.mark.parametrize("text", PAUSED, ids=range(len(PAUSED)))
def test_pauses_and_slow_words_count_and_nothing_is_lost(text: str) -> None:
    """4,200 times `a<break time='10s'/>` were 14 sentences of 50 minutes each, of 3.3 GB."""
    document = parse_ssml(f"<speak>{text}</speak>")
    sentences = list(split_sentences(document, "en-us"))
    for one in sentences:
        spoken = sum(len(phrase.text) / phrase.rate for phrase in one.utterances)
        assert spoken + letters_of_silence(one) <= MOST_VOICED
    assert sum(phrase.pause or 0.0 for one in sentences for phrase in one.utterances) == pytest.approx(
        sum(mark.seconds for mark in document.marks if isinstance(mark, PauseMark))
    )
    written = "".join("".join(phrase.source.split()) for one in sentences for phrase in one.utterances)
    assert written == "".join(document.text.split())


def test_a_sentence_with_pauses_within_the_bound_stays_whole() -> None:
    text = "We were <break time='9s'/> away <break time='9s'/> a year <break time='9s'/> ago."
    (only,) = split_sentences(parse_ssml(f"<speak>{text}</speak>"), "en-us")
    assert [phrase.pause for phrase in only.utterances] == [9.0, 9.0, 9.0, None]


def test_a_text_is_refused_whose_pauses_last_longer_than_an_hour_and_its_words() -> None:
    hour = parse_ssml("<speak>" + "a<break time='10s'/>" * 360 + "</speak>")
    check_silence(hour)
    more = parse_ssml("<speak>" + "a<break time='10s'/>" * 4200 + "</speak>")
    with pytest.raises(InputError, match=r"pauses of the text last 42000 s together, more than 3873 s .an hour"):
        check_silence(more)
    check_silence(parse_marks("word " * 20_000 + "[pause 5]" * 1))
