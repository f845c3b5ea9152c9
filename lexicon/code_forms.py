"""Readers of what computers read: addresses, paths, keys, hashes, identifiers (isReady), and hashtags."""

import re

from lexicon import written_forms as readings
from lexicon.dictionary import cmudict_lookup, named_pronunciation, own_pronunciation, word_set
from lexicon.english import MAX_SPELLED_LETTERS, is_initialism
from lexicon.informal_words import informal_word, is_common, plain_word, tag_words
from lexicon.kept_signs import BACKSLASH, HOME, UNDERSCORE
from lexicon.number_words import digit_words, number_words

_SIGNS = {
    ".": "dot", "/": "slash", "-": "dash", "_": "underscore", "@": "at", ":": "colon", "?": "question mark",
    "=": "equals", "&": "and", "#": "hash", "+": "plus", "~": "tilde", "%": "percent",
    HOME: "tilde", BACKSLASH: "", UNDERSCORE: "underscore",
}  # fmt: skip
_SPELT_OUT = {"vs": "versus", "approx": "approximately"}
_SPELLED_ENDINGS = re.compile("uk|us|de|fr|eu|io|ai|tv|ca|ch|at|au|nz|jp|cn|ru|es|nl|se|pl|be|dk|fi|ie|br|mx|kr|edu")
# folders and endings of files that are spelled
_SPELLED = re.compile(
    "etc|usr|src|py|js|ts|rs|md|sh|cpp|tsx|jsx|yml|hpp|rb|cfg|mp|png|gz|txt|exe|svg|xls|ppt|obj|dll|html|css|pdf"
)
_READ = {"tmp": "temp", "wav": "wave", "jpg": "jpeg", "docx": "doc X", "xlsx": "XLS X"}
FILE_ENDING = (
    "(?:py|js|ts|tsx|jsx|rs|md|sh|cpp|hpp|java|json|yaml|yml|toml|ini|cfg|csv|tsv|txt|pdf|docx?|xlsx?|pptx?|exe|dll|html?|"
    "css|xml|svg|png|jpe?g|gif|mp[34]|wav|zip|gz|tar|log|sql|rb|lua|bat|srt|vtt)"
)
_PIECE = re.compile(r"[^\W\d_]+|[0-9]+|[^\w\s]|_")
_HUMP = re.compile(r"[A-Z]{2,}(?![a-z])|[A-Z]?[a-z]+|[A-Z]")
_TAG_PIECE = re.compile(r"[A-Z]{2,}(?![a-z])|[A-Z]?[^\W\d_A-Z]+|[A-Z]|[0-9]+|[^\W\d_]+")
# Last words of identifiers of two; other words with a capital inside are brands (DeepSeek), which are one word.
_CODE_NOUNS = word_set(
    "Error Exception Handler Manager Service Controller Factory Request Response Button View Test List Set Array Type "
    "Class Object Event Listener Builder Model Config Context Client Server Provider Node Info Name Key Value Queue "
    "Stream Reader Writer Parser Table Field Filter Thread Buffer Loader Helper Component"
)
_CODE_SHORT = word_set("int str num obj idx len args img btn msg ctx src init func var")
COLOR = r"#(?=[0-9]{0,5}[A-Fa-f])(?=[A-Fa-f]{0,5}[0-9])[0-9A-Fa-f]{6}(?!\w)"
KEYS = r"(?:[Cc]trl|CTRL|[Cc]ontrol|[Aa]lt|ALT|[Ss]hift|SHIFT|[Cc]md|CMD|[Cc]ommand|[Ww]in|[Ff]n|[Oo]ption|⌘)"
_KEY_NAMES = {"ctrl": "control", "cmd": "command", "del": "delete", "esc": "escape", "ins": "insert", "win": "windows"}


def _unambiguous(written: str) -> str:
    """A word of an address or tag in an unambiguous form: lower case, or an initialism in capitals."""
    if written.isupper() and len(written) > 1 and not re.fullmatch("[IVXLCDM]+", written):
        return written
    small = written.lower()
    return _SPELT_OUT.get(small) or readings.read_table("symbols.tsv").get(small, (informal_word(small),))[0]


def _letters(word: str) -> str:
    return word.upper() if len(word) <= 3 else " ".join(word.upper())


def address_words(written: str) -> str:
    """www.example.com/a is WWW dot example dot com slash a."""
    bare = re.sub(r"^[A-Za-z]{2,8}://", "", written).rstrip("/")
    host = re.match(r"[^/?#]*", bare)
    last_dot = bare.rfind(".", 0, host.end() if host else None)
    words = []
    for piece in _PIECE.finditer(bare):
        text = piece.group()
        if text[0].isdigit():
            words.append(number_words(text) if len(text) < 5 else digit_words(text))
        elif text.isalpha():
            is_spelled = text == "www" or (piece.start() == last_dot + 1 and _SPELLED_ENDINGS.fullmatch(text))
            words.append(text.upper() if is_spelled else _spelled_or_word(text))
        elif text in _SIGNS:
            words.append(_SIGNS[text])
    return " ".join(filter(None, words))


def _spelled_or_word(text: str) -> str:
    small = text.lower()
    if small in _READ:
        return _READ[small]
    if _SPELLED.fullmatch(small):
        return _letters(small)
    return _unambiguous(text if text.isupper() and len(text) <= MAX_SPELLED_LETTERS else small)


def read_address(m: re.Match[str], _: str) -> str:
    """a@b.com is a at b dot com."""
    return address_words(m.group())


def read_path(m: re.Match[str], _: str) -> str:
    r"""/etc/hosts is slash E T C slash hosts, C:\Users C Users."""
    written = m.group()
    if written[1:2] == ":":
        return f"{written[0].upper()} {address_words(written[2:])}"
    dots = "dot " if written.startswith("./") else ""
    return dots + address_words(written.removeprefix("." if dots else ""))


def read_hashtag(m: re.Match[str], _: str) -> str:
    """#MachineLearning2024 is hashtag machine learning twenty twenty-four, #nofilter hashtag no filter."""
    words = " ".join(
        readings.year_or_number_words(piece) if piece[0].isdigit() else _tag_piece(piece, m.group()[0])
        for piece in _TAG_PIECE.findall(m.group()[1:])
    )
    return f"{'hashtag' if m.group()[0] == '#' else 'at'} {words}".strip()


def _tag_piece(piece: str, sign: str) -> str:
    return (
        tag_words(piece) if sign == "#" and piece.islower() and informal_word(piece) == piece else _unambiguous(piece)
    )


def read_keys(m: re.Match[str], _: str) -> str:
    """Ctrl+C is control C."""
    names = [key.strip() for key in m.group().split("+")]
    return " ".join(_KEY_NAMES.get(name.lower(), name.lower() if len(name) > 2 else _key(name)) for name in names)


def _key(name: str) -> str:
    """C, and F four of F4."""
    letters, digits = name.rstrip("0123456789"), name.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz")
    return (
        f"{letters.upper()} {number_words(digits)}".strip()
        if digits and letters
        else (digits and number_words(digits)) or name.upper()
    )


def read_hash(m: re.Match[str], _: str) -> str:
    """4f3c2a9 is four F three C two A nine, 0x1F zero X one F."""
    return " ".join(digit_words(sign) if sign.isdigit() else sign.upper() for sign in m.group() if sign.isalnum())


def is_color(written: str) -> bool:
    """Whether a word with # is a colour of hexadecimal digits (#FF8800), not a hashtag of letters (#facade)."""
    return re.fullmatch(COLOR, written) is not None


def read_color(m: re.Match[str], previous: str) -> str:
    """#FF8800 is hash F F eight eight zero zero."""
    return f"hash {read_hash(m, previous)}"


def read_identifier(m: re.Match[str], _: str) -> str:
    """Words of an identifier (NullPointerException) are its humps; names with capitals inside stay (YouTube)."""
    written = m.group()
    if own_pronunciation(written) or named_pronunciation(written) or cmudict_lookup(written):
        return written
    humps = _HUMP.findall(written)
    is_code = len(humps) > 2 or written[:1].islower() or humps[-1] in _CODE_NOUNS
    if len(humps) < 2 or "".join(humps) != written or not is_code:
        return written
    words = [hump if is_initialism(hump) and len(hump) > 1 else informal_word(hump.lower()) for hump in humps]
    is_known = all(len(word) > 1 and (word.isupper() or is_common(word) or word in _CODE_SHORT) for word in words)
    return " ".join(words) if is_known else written


def read_word(m: re.Match[str], _: str) -> str:
    """A word as it is said: thx is thanks, sooooo so, a name itself."""
    written = m.group()
    return informal_word(written) if written.isascii() else plain_word(written)
