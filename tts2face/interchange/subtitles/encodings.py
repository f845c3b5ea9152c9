"""The encoding of text that is not UTF-8, by the language where it is known, else by the letters that make words."""

import re
from dataclasses import dataclass
from itertools import pairwise
from types import MappingProxyType

# Encodings of files from Windows, by the language of the words.
_ENCODINGS = MappingProxyType({
    **dict.fromkeys(["cs", "pl", "hu", "hr", "sk", "sl", "ro", "bs", "sq"], "cp1250"),
    **dict.fromkeys(["ru", "uk", "bg", "be", "mk", "sr"], "cp1251"),
    **dict.fromkeys(["en", "de", "fr", "es", "it", "pt", "nl", "sv", "da", "nb", "fi", "is", "ca", "ga"], "cp1252"),
    "el": "cp1253", "tr": "cp1254", "az": "cp1254", "he": "cp1255", "ar": "cp1256", "fa": "cp1256", "ur": "cp1256",
    **dict.fromkeys(["et", "lv", "lt"], "cp1257"),
    "vi": "cp1258", "th": "cp874", "ja": "cp932", "ko": "cp949", "cmn": "gbk", "zh": "gbk", "yue": "big5hkscs",
})  # fmt: skip
# Letters beyond ASCII and frequent short words of languages, by which a decoding makes words. Their order decides
# between equal ones: languages of more files first.
_LATIN = MappingProxyType({
    "en": ("cp1252", "àâçèéêëîïôûñöü", "the and to of a in is you that it for i my do we he she"),
    "fr": ("cp1252", "àâçèéêëîïôùûüœæ", "le la les de des et est un une je tu il que pas vous nous ne pour"),
    "de": ("cp1252", "äöüß", "der die das und ist nicht ich du sie wir ein eine es zu den mit für"),
    "es": ("cp1252", "áéíñóúü¿¡", "el la los de que y no en un una es por qué lo se me te con para"),
    "pt": ("cp1252", "àáâãçéêíóôõúü", "o a os de que e não um uma é eu você para com se me em"),
    "it": ("cp1252", "àèéìòù", "il la che di e non un una è per sono mi ti lo si ma con ho"),
    "sv": ("cp1252", "åäöé", "och det är jag inte en ett att du vi som på med för har"),
    "da": ("cp1252", "æøåé", "og det er jeg ikke en et at du vi som på med for har"),
    "pl": ("cp1250", "ąćęłńóśźż", "i w nie to się na że jest do co jak tak ja ty z za mnie"),
    "cs": ("cp1250", "áčďéěíňóřšťúůýž", "a je to se na že v ne jsem co ale tak jak já my si do po"),
    "hu": ("cp1250", "áéíóöőúüű", "a az és nem hogy egy van ez is csak de mi meg én te ki"),
    "hr": ("cp1250", "čćđšž", "je i u da se na ne to što sam za ti ja su si molim kako"),
    "ro": ("cp1250", "ăâîşţ", "și şi nu de la un o este că în am ce cu mai pe să te"),
    "sk": ("cp1250", "áäčďéíĺľňóôŕšťúýž", "a je to sa na že nie som čo ale tak ako ja my si do po"),
    "tr": ("cp1254", "çğıöşüâîİ", "bir ve bu ne için değil var ben sen o mi mı da de çok iyi evet"),
    "lt": ("cp1257", "ąčęėįšųūž", "ir ne kad aš tai yra į su ką tu jis bet ar mes taip"),
    "lv": ("cp1257", "āčēģīķļņšūž", "un ir es tu ne ka tas ar par kas vai mēs man jā"),
    "et": ("cp1257", "äõöüšž", "ja on ei see ma sa et mis kui ta me oli nii aga"),
    "vi": ("cp1258", "àáâãèéêìíòóôõùúýăđĩũơưạảấầẩẫậắằẳẵặẹẻẽếềểễệỉịọỏốồổỗộớờởỡợụủứừửữựỳỵỷỹ"
           "\u0300\u0301\u0303\u0309\u0323",
           "không là có và của anh em tôi cho một"),
    "is": ("cp1252", "áðéíóúýþæö", "að og ég er ekki það þú við en hann hún til með"),
})  # fmt: skip
_SCRIPTS = (
    ("cp1251", re.compile("[а-яё]"), "и в не на что я он с это как ты мы да но по"),
    ("koi8-r", re.compile("[а-яё]"), "и в не на что я он с это как ты мы да но по"),
    ("cp1253", re.compile("[α-ωά-ώς]"), "και το να δεν είναι τι με για του την"),
    ("cp1255", re.compile("[א-ת]"), "את לא זה אני של מה על כן הוא"),
    ("cp1256", re.compile("[ء-ي]"), "في من لا ما هذا أن على هل أنا"),
    ("cp874", re.compile("[ก-ฺเ-์]"), ""),
)  # fmt: skip
# The most frequent characters of running Chinese in both scripts, which other decodings give rarely.
_SIMPLIFIED = (
    "的一是不了在人有我他这个们中来上大为和国地到以说时要就出会可也你对生能而子那得于着下自之年过"
    "发后作里用道行所然家种事成方多经么去法学如都同现当没动面起看定天分还进好小部其些主样理心她本前开但因"
    "只从想实吗什谁吧呢很再见知给让谢请"
)
_TRADITIONAL = (
    "的一是不了在人有我他這個們中來上大為和國地到以說時要就出會可也你對生能而子那得於著下自之年過"
    "發後作裡用道行所然家種事成方多經麼去法學如都同現當沒動面起看定天分還進好小部其些主樣理心她本前開但因"
    "只從想實嗎什誰吧呢很再見知給讓謝請"
)
# What each encoding of several bytes gives often, and the least share of it among the letters beyond ASCII.
_WIDE = (
    ("cp932", re.compile("[ぁ-ヶー]"), 0.2),
    ("cp949", re.compile("[가-힣]"), 0.7),
    ("gbk", re.compile(f"[{_SIMPLIFIED}]"), 0.15),
    ("big5hkscs", re.compile(f"[{_TRADITIONAL}]"), 0.15),
)
_CANDIDATES = (
    *("cp1252", "cp1250", "cp1254", "cp1257", "cp1258"),
    *(name for name, _, _ in _SCRIPTS),
    *(name for name, _, _ in _WIDE),
)
_WORD = re.compile(r"[^\W\d_]+")
_ASCII_LETTER = re.compile("[A-Za-z]")
_HIGH = re.compile(r"[^\x00-\x7f]")
_MONEY = re.compile(r"[£¥¢](?=\s?\d)|(?<=\d)[£¥¢]")
_BY_DIGIT = re.compile(r"(?<=\d)(?![\x00-\x7f])[^\W\d_]|(?![\x00-\x7f])[^\W\d_](?=\d)")  # "Ł5" is no word, but £5
_NEUTRAL = frozenset("–—‘’‚“”„†•…‹›«»€™©®°§·\u00a0♪¿¡№")
MIN_SCORE = 0.6
MIN_NAMED_SCORE = 0.3  # of the encoding of a language that is known: its words may have names of others
FALLBACK = "cp1252"
MIN_BYTES = 4  # of which a guess is more than chance


@dataclass(frozen=True, slots=True)
class Decoded:
    """Text with the encoding in which it was read; `is_guess` says that nothing states it."""

    text: str
    encoding: str
    is_guess: bool = False
    n_damaged: int = 0


def encoding_of_language(language: str | None) -> str | None:
    """Encoding of Windows for a language, or None."""
    if not language:
        return None
    tag = language.lower().replace("_", "-")
    if tag.startswith(("zh-tw", "zh-hk", "zh-hant", "zh-mo")):
        return "big5hkscs"
    if tag.startswith("sr-latn"):
        return "cp1250"
    return _ENCODINGS.get(tag) or _ENCODINGS.get(tag.partition("-")[0])


def guess_encoding(content: bytes, language: str | None = None) -> Decoded | None:
    """Text by the encoding of its language, else by the one in which its letters make words; None if it is no text."""
    if len(content) < MIN_BYTES:
        text = _decoded(content, FALLBACK)
        return None if text is None else Decoded(text, FALLBACK, is_guess=True)
    named = encoding_of_language(language)
    text = None if named is None else _decoded(content, named)
    if named is not None and text is not None and _score(text, named) >= MIN_NAMED_SCORE:
        return Decoded(text, named, is_guess=True)
    scored: dict[str, tuple[float, str]] = {}
    for name in _CANDIDATES:
        text = _decoded(content, name)
        if text is not None:
            scored[name] = (_score(text, name), text)
    if not scored:
        return None
    best = max(scored, key=lambda name: scored[name][0])
    if scored[best][0] < MIN_SCORE:
        best = FALLBACK
    return Decoded(scored[best][1], best, is_guess=True) if best in scored else None


def _decoded(content: bytes, name: str) -> str | None:
    try:
        return content.decode(name)
    except UnicodeDecodeError:
        return None


def _score(text: str, name: str) -> float:
    """How much of the letters beyond ASCII make words of a language of an encoding; about 0 to 1.5."""
    high = [character for character in _HIGH.findall(text) if character not in _NEUTRAL]
    if not high:
        return 1.0 if name == FALLBACK else 0.0
    for wide, frequent, share in _WIDE:
        if wide == name:
            found = len(frequent.findall(text)) / len(high)
            return min(found / share, 1.0) + 0.4 * (found >= share) if found >= share / 2 else 0.0
    words = [word for word in _WORD.findall(text) if _HIGH.search(word)]
    wrong = sum(_is_badly_cased(word) for word in words) / max(len(words), 1)
    for script, letters, frequent_words in _SCRIPTS:
        if script == name:
            share = len(letters.findall(text.lower())) / len(high)
            mixed = sum(_ASCII_LETTER.search(word) is not None for word in words) / max(len(words), 1)
            return share - wrong - mixed + _share_of(text, frequent_words)
    in_words = "".join(_HIGH.findall(_BY_DIGIT.sub("", text))).lower()
    n_money = len(_MONEY.findall(text))
    scores = [
        (sum(character in alphabet for character in in_words) + n_money) / len(high)
        - wrong
        + _share_of(text, frequent_words)
        - 0.002 * order
        for order, (encoding, alphabet, frequent_words) in enumerate(_LATIN.values())
        if encoding == name
    ]
    return max(scores)


def _share_of(text: str, words: str) -> float:
    """Share of the words of a text that are among some, at most .5."""
    known = frozenset(words.split())
    found = [word for word in _WORD.findall(text.lower())]
    return min(sum(word in known for word in found) / max(len(found), 1), 0.5)


def _is_badly_cased(word: str) -> bool:
    """Whether capitals stand within or after small letters."""
    return any(after.isupper() and before.islower() for before, after in pairwise(word))
