"""The alphabet of the voice ``heart``: letters of misaki, in which Kokoro and its students are trained, for phones."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

from lexicon.intonation import Movement, movements
from lexicon.pauses import DASH, ELLIPSIS, PAUSES_S
from lexicon.phones import PHONES, nearest_phones
from lexicon.pronounce import Word
from lexicon.tones import EVEN, Tone
from tts2face.sound.voice import split_spoken_sentences

Alphabet = Mapping[str, str]  # letters of phones
LETTERS_OF_PHONE = MappingProxyType({
    "eɪ": "A", "aɪ": "I", "oʊ": "O", "aʊ": "W", "ɔɪ": "Y", "dʒ": "ʤ", "tʃ": "ʧ", "ə": "ə", "ɪ": "ɪ", "i": "i",
    "ɛ": "ɛ", "æ": "æ", "ɑ": "ɑ", "ɔ": "ɔ", "ʊ": "ʊ", "u": "u", "ʌ": "ʌ", "ɝ": "ɜɹ", "ɚ": "əɹ", "ɹ": "ɹ", "ð": "ð",
    "θ": "θ", "ʃ": "ʃ", "ʒ": "ʒ", "ŋ": "ŋ", "j": "j", "ɡ": "ɡ", "h": "h", "b": "b", "d": "d", "f": "f", "k": "k",
    "l": "l", "m": "m", "n": "n", "p": "p", "s": "s", "t": "t", "v": "v", "w": "w", "z": "z",
})  # fmt: skip
# Letters of the British voices: long vowels have their mark, and the diphthongs of NEAR, SQUARE, CURE and GOAT letters.
BRITISH_LETTERS = MappingProxyType(
    {phone: letters for phone, letters in LETTERS_OF_PHONE.items() if phone not in {"oʊ", "æ", "ɝ", "ɚ"}}
    | {"a": "a", "ɑ": "ɑː", "ɒ": "ɒ", "ɔ": "ɔː", "ɜ": "ɜː", "i": "iː", "u": "uː", "əʊ": "Q"}
    | {"eə": "ɛː", "ɪə": "ɪə", "ʊə": "ʊə"}
)
# British words in the letters of an American voice: 12.7 % phone errors by our recogniser for 19.8 % in the letters of
# British ones, which it was not trained in (and 11.4 % of American words).
BRITISH_IN_AMERICAN = MappingProxyType(
    {phone: LETTERS_OF_PHONE.get(phone, letters) for phone, letters in BRITISH_LETTERS.items()}
    | {"a": "æ", "ɒ": "ɑ", "ɜ": "ɜ", "əʊ": "O", "eə": "ɛ"}
)
BRITISH_OF_AMERICAN = MappingProxyType({"oʊ": "əʊ", "æ": "a", "ɝ": "ɜ", "ɚ": "ə"})
STRESS_MARKS = MappingProxyType({1: "ˈ", 2: "ˌ"})
_SYLLABIC, _SHORT_SCHWA = "ᵊ", "ɐ"
_FLAP, _SHORT_I = "T", "ᵻ"
_ENDINGS = MappingProxyType(
    dict.fromkeys(("t", "d"), (("d",),)) | dict.fromkeys(("s", "z", "ʃ", "ʒ", "tʃ", "dʒ"), (("z",),))
)  # -ed after a stop of the tongue, -es after a sibilant
_BEFORE_FLAP = frozenset(phone for phone in LETTERS_OF_PHONE if PHONES[phone].is_vowel) | {"ɹ"}
_ARTICLES = frozenset({("ə",), ("ə", "n"), ("ə", "m")})  # a, an, am
CLAUSE_MARKS = frozenset({",", ";", ":", DASH, ELLIPSIS})
MARKS = "".join(PAUSES_S)  # punctuation among the letters
MAX_LETTERS = 400  # the model accepts at most this many letters in one call


def voice_phones(phones: Sequence[str], alphabet: Alphabet = LETTERS_OF_PHONE) -> list[str]:
    """Phones of the voice's alphabet; a phone that the alphabet lacks is replaced by the nearest one."""
    return [own for phone in phones for own in _own_phones(phone, alphabet)]


def _own_phones(phone: str, alphabet: Alphabet) -> tuple[str, ...]:
    if alphabet is not LETTERS_OF_PHONE:
        phone = BRITISH_OF_AMERICAN.get(phone, phone)
    return nearest_phones(phone, alphabet.keys())


def word_letters(
    phones: Sequence[str], stress: Sequence[int], alphabet: Alphabet = LETTERS_OF_PHONE
) -> tuple[str, tuple[int, ...]]:
    """Letters of a word, and the place of the first letter of each of its `voice_phones`.

    The alphabet distinguishes variants of one phone: /t/ between vowels is a flap unless a stressed vowel or a syllabic
    /n/ follows, /ə/ before a final /l/ is short, and so is the vowel of the endings -ed and -es.

    Parameters
    ----------
    phones, stress : N
        Phones of the table and their stress: 1 primary, 2 secondary, 0 none.
    alphabet
        Letters of the phones; variants are those of American voices.
    """
    pairs = [
        (own, digit if at == 0 else 0)
        for phone, digit in zip(phones, stress, strict=True)
        for at, own in enumerate(_own_phones(phone, alphabet))
    ]
    letters, places = "", []
    for at, (_, digit) in enumerate(pairs):
        letters += STRESS_MARKS.get(digit, "")
        places.append(len(letters))
        letters += _variant(pairs, at) if alphabet is LETTERS_OF_PHONE else _british(pairs, at, alphabet)
    is_article = alphabet is LETTERS_OF_PHONE and tuple(phone for phone, _ in pairs) in _ARTICLES and pairs[0][1] == 0
    return (_SHORT_SCHWA + letters[1:] if is_article else letters), tuple(places)


def _variant(pairs: Sequence[tuple[str, int]], at: int) -> str:
    """Letters of the phone at an index."""
    phone, digit = pairs[at]
    after = [following for following, _ in pairs[at + 1 : at + 3]]
    if phone == "t" and 0 < at < len(pairs) - 1 and pairs[at - 1][0] in _BEFORE_FLAP:
        is_unstressed = PHONES[after[0]].is_vowel and pairs[at + 1][1] == 0
        return _FLAP if is_unstressed and after != ["ə", "n"] else "t"
    if phone == "ə" and at > 0 and not digit and after[:1] == ["l"]:
        return LETTERS_OF_PHONE[phone] if len(after) == 2 and PHONES[after[1]].is_vowel else _SYLLABIC
    if phone in {"ə", "ɪ"} and not digit and at > 0 and tuple(after) in _ENDINGS.get(pairs[at - 1][0], ()):
        return _SHORT_I
    return LETTERS_OF_PHONE[phone]


def _british(pairs: Sequence[tuple[str, int]], at: int, alphabet: Alphabet) -> str:
    """British letters of the phone at an index; the vowel at the end of "happy" is short."""
    phone, digit = pairs[at]
    return phone if phone == "i" and not digit and at == len(pairs) - 1 else alphabet[phone]


@dataclass(frozen=True, slots=True)
class LetteredWord:
    """A spoken word with its phones, and its letters in the voice's alphabet with the punctuation after it."""

    text: str
    phones: tuple[str, ...]
    letters: str
    places: tuple[int, ...]  # index of the letter of each phone
    tone: Tone = EVEN

    @property
    def n_spoken(self) -> int:
        """Number of letters without punctuation."""
        return len(self.letters.rstrip(MARKS))

    @property
    def stressed_vowel(self) -> int:
        """Index of the letter of the vowel with the main stress, or of the last vowel; else of the first phone."""
        vowels = [place for phone, place in zip(self.phones, self.places, strict=True) if PHONES[phone].is_vowel]
        mark = next(
            (self.letters.rindex(mark) for mark in STRESS_MARKS.values() if mark in self.letters), len(self.letters)
        )
        return next((place for place in vowels if place > mark), (vowels or [self.places[0]])[-1])


@dataclass(frozen=True, slots=True)
class LetteredPart:
    """Words that the model synthesises in one call, and the movements of their F0."""

    words: tuple[LetteredWord, ...]
    movements: tuple[Movement, ...]

    @property
    def letters(self) -> str:
        """Letters of all words, with spaces between them."""
        return " ".join(word.letters for word in self.words)

    @property
    def starts(self) -> tuple[int, ...]:
        """Index of the first letter of each word."""
        found = [0]
        for word in self.words:
            found.append(found[-1] + len(word.letters) + 1)
        return tuple(found[:-1])


def lettered_parts(words: Sequence[Word], alphabet: Alphabet = LETTERS_OF_PHONE) -> Iterator[LetteredPart]:
    """Parts of each sentence, with at most `MAX_LETTERS` letters."""
    for sentence in split_spoken_sentences(words):
        found = movements([word.text for word in sentence], [word.mark for word in sentence])
        first = 0
        for part in _cut_words([_lettered(word, alphabet) for word in sentence]):
            end = first + len(part)
            inside = (move for move in found if first <= move.at and move.until < end)
            yield LetteredPart(tuple(part), tuple(move.shift(-first) for move in inside))
            first = end


def _lettered(word: Word, alphabet: Alphabet) -> LetteredWord:
    letters, places = word_letters(word.phones, word.stress, alphabet)
    return LetteredWord(word.text, tuple(voice_phones(word.phones, alphabet)), letters + word.mark, places, word.tone)


def _cut_words(words: Sequence[LetteredWord]) -> Iterator[list[LetteredWord]]:
    """Divide words into parts of at most `MAX_LETTERS` letters, after a clause mark if the part has one."""
    part: list[LetteredWord] = []
    length = 0
    for word in words:
        if part and length + len(word.letters) + 1 > MAX_LETTERS:
            marks = [at for at, earlier in enumerate(part) if earlier.letters[-1:] in CLAUSE_MARKS]
            keep = marks[-1] + 1 if marks else len(part)
            yield part[:keep]
            part = part[keep:]
            length = sum(len(earlier.letters) + 1 for earlier in part)
        part.append(word)
        length += len(word.letters) + 1
    if part:
        yield part
