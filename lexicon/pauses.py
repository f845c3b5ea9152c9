"""How long voices are silent at punctuation, at a rate of 1."""

import re
from types import MappingProxyType

DASH, ELLIPSIS = "—", "…"
# Seconds of silence after a word, by the punctuation behind it; of adjacent marks the last one of this order counts.
PAUSES_S = MappingProxyType(
    {"": 0.0, ",": 0.25, DASH: 0.3, ":": 0.35, ";": 0.35, ELLIPSIS: 0.45, ".": 0.5, "!": 0.5, "?": 0.5}
)
PARAGRAPH_S = 0.8  # at a blank line
MARKS = frozenset("".join(PAUSES_S))
SIMPLE_MARKS = MappingProxyType({DASH: ",", ELLIPSIS: ","})  # of voices that know neither
_SIGNS_OF_MARK = MappingProxyType({
    ",": ",，、،", DASH: "‒–—―", ":": ":：", ";": ";；؛", ELLIPSIS: "…", ".": ".。｡।॥۔።", "!": "!！", "?": "?？؟",
})  # fmt: skip
MARK_OF_SIGN = MappingProxyType({sign: mark for mark, signs in _SIGNS_OF_MARK.items() for sign in signs})
_END = re.compile(r"(?P<dots>\.{2,})?[\s\"'“”‘’«»‹›„「」『』)\]}]*\Z")
_BLANK_END = re.compile(r"\n\s*\n\s*\Z")


def pause_behind(written: str, *, is_cut: bool = False) -> float:
    """Seconds of silence behind a written sentence, or behind a part of one that goes on (`is_cut`)."""
    if _BLANK_END.search(written):
        return PARAGRAPH_S
    return PAUSES_S[last_mark(written) or ("," if is_cut else ".")]


def last_mark(written: str) -> str:
    """Mark of `PAUSES_S` at the end of a written text, within quotes and brackets or not; empty if there is none."""
    end = _END.search(written)
    if end is not None and end["dots"]:
        return ELLIPSIS
    return MARK_OF_SIGN.get(written[: end.start()][-1:] if end else "", "")
