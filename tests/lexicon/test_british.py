"""British English: lexical sets, links, readings by context, and what is said of a voice of another accent."""

import pytest

from lexicon import misaki
from lexicon.british import in_british_phones
from lexicon.dictionary import arpabet_segments
from lexicon.ipa import parse_ipa
from lexicon.pronounce import Dictionary, has_dictionary, pronounce
from lexicon.sequence import SILENCE
from tts2face.sound import fitting, voice_pool
from tts2face.sound.fitting import fitting_voice
from tts2face.sound.heart_letters import BRITISH_IN_AMERICAN, BRITISH_LETTERS, word_letters
from tts2face.sound.piper import ENGLISH_LETTERS, english_letters
from tts2face.sound.voice_pool import load_voice

# One word of each lexical set (Wells 1982, vol. 1, pp. 127 to 168), and what else differs.
WORDS = {
    "path": "pɑθ", "aunt": "ɑnt", "staff": "stɑf", "cab": "kab", "sock": "sɒk", "off": "ɒf", "cloth": "klɒθ",
    "boat": "bəʊt", "arrow": "aɹəʊ", "turn": "tɜn", "farm": "fɑm", "calm": "kɑm", "short": "ʃɔt", "more": "mɔ",
    "fear": "fɪə", "fare": "feə", "thought": "θɔt", "paper": "peɪpə", "butter": "bʌtə", "stupid": "stjupɪd",
    "duty": "djuti", "happy": "hapi", "fire": "faɪə", "futile": "fjutaɪl", "clerk": "klɑk", "herbs": "hɜbz",
}  # fmt: skip


def _phones(text: str) -> list[str]:
    return ["".join(word.phones) for word in pronounce(text, "en-gb").words]


@pytest.mark.parametrize("word", WORDS)
def test_lexical_sets(word: str) -> None:
    assert _phones(word) == [WORDS[word]]


def test_the_ending_of_places_in_ham_is_weak() -> None:
    assert _phones("Birmingham, Balham, Wokingham, Abraham, ham") == [
        "bɜmɪŋəm", "baləm", "wəʊkɪŋəm", "eɪbɹəham", "ham",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "is_linked"),
    [
        ("more of it", True), ("the nurse and Anne", False), ("a pair of", True), ("doctor and", True),
        ("there are", True), ("fire engine", True), ("more, of course", False), ("more tea", False),
        ("law and", False), ("the idea of", False), ("her own", True),
    ],
)  # fmt: skip
def test_r_links_words(text: str, is_linked: bool) -> None:
    assert any(word.endswith("ɹ") for word in _phones(text)) == is_linked


@pytest.mark.parametrize(
    ("text", "at", "phones"),
    [
        ("The lead pipe is old.", 1, "lɛd"),
        ("They lead us.", 1, "lid"),
        ("They tear it.", 1, "teəɹ"),
        ("The BBC and ZX.", 1, "bibisi"),
        ("The BBC and ZX.", 3, "zɛdɛks"),
        ("It is for him.", 2, "fɔ"),
        ("What is it for?", 3, "fɔ"),
        ("It was of use.", 1, "wɒz"),
        ("5 apples and 2.5 km", 0, "faɪv"),
        ("Djokovic's car", 0, "dʒəʊkəvɪtʃɪz"),
        ("well-known", 0, "wɛlnəʊn"),
        ("Microplastics sink.", 0, "maɪkɹəʊplastɪks"),
    ],
)
def test_words_in_their_context(text: str, at: int, phones: str) -> None:
    assert _phones(text)[at] == phones


def test_american_pronunciations_in_british_phones() -> None:
    said = {
        "Torvalds": "T AO1 R V AO0 L D Z",
        "Roku": "R OW1 K UW0",
        "Nuuk": "N UW1 K",
        "Coruña": "K AH0 R UW1 N Y AH0",
    }
    british = {word: "".join(s.phone for s in in_british_phones(arpabet_segments(n), word)) for word, n in said.items()}
    assert british == {"Torvalds": "tɔvɔldz", "Roku": "ɹəʊku", "Nuuk": "njuk", "Coruña": "kəɹunjə"}


def test_a_dictionary_takes_precedence_and_is_not_linked() -> None:
    own = Dictionary({"car": parse_ipa("kɑ")})
    assert pronounce("car and car", "en-gb", own).words[0].phones == ("k", "ɑ")


def test_a_letter_with_an_accent_is_one_sound() -> None:
    assert _phones("À la carte")[1:] == ["lɑ", "kɑt"]


def test_without_the_dictionary_espeak_reads(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(misaki, "_text", lambda accent, grade: b"{}")
    assert not has_dictionary("en-gb")
    assert has_dictionary("en-us")
    assert _phones("bath") == ["baθ"]


def test_espeak_speaks_the_printed_phones() -> None:
    text = "The poor bird near the square saw a car and a goat, not far away."
    speech = load_voice("espeak", "en-gb").speak(text)
    printed = pronounce(text, "en-gb")
    assert [phone for phone in speech.phones.phones if phone != SILENCE] == list(printed.phones)
    assert [word.text for word in speech.words] == [word.text for word in printed.words]


def test_heart_speaks_british_phones_in_its_letters() -> None:
    assert word_letters(["k", "ɒ", "t"], [0, 1, 0], BRITISH_IN_AMERICAN)[0] == "kˈɑt"
    assert word_letters(["ɡ", "əʊ", "t"], [0, 1, 0], BRITISH_IN_AMERICAN)[0] == "ɡˈOt"
    assert word_letters(["b", "ʌ", "t", "ə"], [0, 1, 0, 0], BRITISH_IN_AMERICAN)[0] == "bˈʌtə"
    assert set(BRITISH_IN_AMERICAN) == set(BRITISH_LETTERS)


def test_piper_s_british_letters_have_lengths_and_no_flaps() -> None:
    alphabet = set("bɪəiːtɜɑɒnɐˈˌ")
    assert english_letters(parse_ipa("nˈɪə"), ["n", "ɪ", "ə"], alphabet) == "nˈiə"
    assert english_letters(parse_ipa("bˈɜtə"), ["b", "ɜ", "t", "ə"], alphabet) == "bˈɜːtə"
    assert ENGLISH_LETTERS["ɜ"] == "ɜː"


def test_the_accent_of_the_voice_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    fitting_voice.cache_clear()
    monkeypatch.setattr(voice_pool, "is_installed", lambda name: name not in {"emma", "fable"})
    found = fitting.fitting_voice(None, "en-gb")
    assert found.name == "heart"
    assert "voices add emma" in found.sentence
    assert fitting.fitting_voice(None, "en-us").sentence == ""
    fitting_voice.cache_clear()
