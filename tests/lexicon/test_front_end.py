"""One front end: what `tts2face phones` prints is what the voices speak and align."""

import random
import re
from pathlib import Path
from xml.sax.saxutils import escape

import pytest

from lexicon.errors import InputError
from lexicon.foreign_words import make_readable
from lexicon.misaki import PHONE_OF_LETTER
from lexicon.pronounce import pronounce
from lexicon.sentences import split_sentences
from lexicon.spoken_words import pronounce_marked
from lexicon.text_marks import parse_marks
from tts2face.session.phrase_delivery import phrase_content
from tts2face.sound.heart_letters import voice_phones, word_letters
from tts2face.sound.voice import pronounce_content

DECIDED = Path(__file__).with_name("decided_sentences.tsv")
SENTENCES = [tuple(line.split("\t")) for line in DECIDED.read_text(encoding="utf-8").splitlines()[1:]]
N_RANDOM = 300  # 2,000 others were run once
PIECES = re.split(
    " ",
    "[pause 0.3] $ % ° 1/2 10⁶ 1e-9 C# A4 ... — – “ ” ' ’ ( ) [ { } & @ # http://x.y é ñ ß Ω μ ½ ³ 🙂 👍🏽 "
    "\u200b \u00a0 read lead a ﬁ Ǆ ａｂｃ ① ❽ Ⅳ ٣ ʼ ˈ ː ə Ж π 中 가 א !! ?! ;; - -- + = < > | \\ ^2 ~5 No. St. Mr. "
    "e.g. U.S. IV II IT 5 lb. 3x4 10/10 0/0 99999999999999999999 007 1.2.3 12:99 31/31/2020 'tis can't've O' 's a-b "
    "X- A- A qzxaaa hmm pst I'm I",
)


def test_decided_readings(subtests: pytest.Subtests) -> None:
    """The differences between this front end and that of the voice were decided one by one (docs/front-end.md)."""
    for text, ipa in SENTENCES:
        with subtests.test(text):
            assert " ".join(word.ipa + word.mark for word in pronounce(text).words) == ipa


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("It weighs 5 lb.", "It weighs five pounds"),
        ("A 10 lb. bag.", "A ten pound bag"),
        ("See p. 5.", "See page five"),
        ("CO2 rose.", "CO two rose"),
        ("She writes C#.", "She writes C sharp"),
        ("A #hashtag.", "A hashtag hashtag"),
        ("World War II and III.", "World War two and three"),
        ("On A4 paper.", "On A-four paper"),
        ("1 tsp salt.", "one teaspoon salt"),
        ("3 in. long.", "three inches long"),
        ("1e-9 m.", "one times ten to the minus nine meters"),
        ("10⁶ cells.", "ten to the power of six cells"),
        ("We scored 10/10.", "We scored ten out of ten"),
        ("A 6 ft 2 in man.", "A six feet two inches man"),
    ],
)
def test_forms_that_were_read_wrongly(text: str, said: str) -> None:
    assert " ".join(word.text for word in pronounce(text).words) == said


@pytest.mark.parametrize(
    ("text", "arpabet"),
    [
        ("IT", "AY2 T IY1"),
        ("A4", "EY1 F AO2 R"),
        ("Siobhan", "SH IH0 V AO1 N"),
        ("Nguyen", "W IH1 N"),
        ("Tchaikovsky", "CH AY0 K AO1 F S K IY0"),
        ("O'Neill", "OW0 N IY1 L"),
        ("crème", "K R EH1 M"),
        ("déjà", "D EY2 ZH AA1"),
        ("jalapeño", "HH AA2 L AH0 P EY1 N Y OW0"),
        ("'Tis", "T IH1 Z"),
        ("Tuesday's", "T UW1 Z D EY2 Z"),
        ("ability", "AH0 B IH1 L AH0 T IY0"),
    ],
)
def test_words_that_were_read_wrongly(text: str, arpabet: str) -> None:
    assert " ".join(pronounce(text).words[0].arpabet) == arpabet


def spoken_words(text: str) -> list[tuple[str, tuple[str, ...], tuple[int, ...]]]:
    """Words that a voice is given for a text, phrase by phrase, with phones and stress."""
    return [
        (word.text, word.phones, word.stress)
        for sentence in split_sentences(make_readable(parse_marks(text, "en-us"), "en-us")[0], "en-us")
        for phrase in sentence.utterances
        for word in pronounce_content(phrase_content(phrase), phrase.language or "en-us", {})
    ]


def check_printed_is_spoken(text: str) -> None:
    printed = pronounce_marked(parse_marks(text, "en-us"), "en-us").words
    assert [(word.text, word.phones, word.stress) for word in printed] == spoken_words(text)
    for word in printed:
        letters, places = word_letters(word.phones, word.stress)
        aligned = voice_phones(word.phones)
        assert len(places) == len(aligned)
        for place, phone in zip(places, aligned, strict=True):
            assert PHONE_OF_LETTER[letters[place]] == {"ɚ": "ə"}.get(phone, phone) or letters[place] == "ᵻ"


def test_printed_phones_are_spoken_and_aligned(subtests: pytest.Subtests) -> None:
    for text, _ in SENTENCES:
        with subtests.test(text):
            check_printed_is_spoken(text)


def test_printed_phones_of_marked_texts_are_spoken() -> None:
    check_printed_is_spoken("[style:delighted]I read[/style] the book, [pause 0.5] and he wound the clock. " * 6)
    check_printed_is_spoken(
        "<speak>Mr. <phoneme ph='bˈɑb'>Rob</phoneme> has <say-as interpret-as='characters'>AB1</say-as>, "
        "<sub alias='lead pipe'>lp</sub> and <prosody rate='slow'>$3.50 tears</prosody>.</speak>"
    )


def random_text(rng: random.Random) -> str:
    ranges = ((32, 126), (0xA0, 0x24F), (0x2000, 0x2BFF))
    pieces = [
        rng.choice(PIECES) if rng.random() < 0.7 else "".join(chr(rng.randint(*rng.choice(ranges))) for _ in "abc")
        for _ in range(rng.randint(1, 12))
    ]
    text = rng.choice(["", " "]).join(pieces)
    if rng.random() < 0.2:
        clean = escape("".join(letter for letter in text if letter.isprintable() and letter not in "[]"))
        return f"<speak>{clean} <phoneme ph='bˈɑtyʀ'>word</phoneme></speak>"
    return text


def test_random_texts_are_printed_as_spoken_or_refused() -> None:
    rng = random.Random(16)
    n_spoken = 0
    for _ in range(N_RANDOM):
        text = random_text(rng)
        try:
            check_printed_is_spoken(text)
        except InputError:
            continue
        n_spoken += 1
    assert n_spoken > N_RANDOM // 2
