"""Marks within the words of a text: tags, directions, emoji, emoticons, links, entities, and those of this project.

``read_parts`` divides a text into parts, of which each is spoken, silent, or a mark; what looks like a mark and is none
is spoken. The rule what is one stands here and in `lexicon.directions`, for every door.
"""

import functools
import html
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType

from lexicon.code_forms import is_color
from lexicon.directions import Direction, find_direction
from lexicon.emoji import EMOJI, emoji_word
from lexicon.emphasis import SPACED
from lexicon.function_words import is_function_word
from lexicon.gesture_marks import FIRST_WORDS, is_gesture
from lexicon.informal_words import tag_words
from lexicon.latex import ENVIRONMENTS, formula_words, is_formula
from lexicon.mark_parts import Cue, End, Own, Part, Rules, Silent, Text
from lexicon.mark_table import PLAIN, TextMark
from lexicon.markdown import Block, split_blocks
from lexicon.tag_names import BREAKS, FOREIGN_MARK, MOOD_TAGS, PASSED, PAUSE_TAGS, UNFOLLOWED

MAX_TAIL = 40  # characters of what is spoken before a mark, and of what follows it
MAX_QUOTED_CHARACTERS = 40
# A bracket, one of the words, and the rest up to the closing bracket, which a mark must have; words with phones up to
# their end. Each part ends where the next begins, so that the scan is linear.
OWN_MARK = (
    r"\[phoneme:(?P<phones>[^\[\]]*)\](?P<words>[^\[\]]*)\[/phoneme\]"
    r"|\[(?P<name>/?(?:style|pause)\b|/nod\b|phoneme(?=:)|/phoneme(?=\]))(?P<rest>[^\[\]]*)(?P<end>\]?)"
    rf"|\[(?P<gesture>(?i:{'|'.join(FIRST_WORDS)})(?![^\W_])[^\[\]]*)(?P<gesture_end>\]?)"
)
_URL = r"\([^()\s]{0,2000}(?:\([^()\s]{0,200}\)[^()\s]{0,200})?(?:\s+\"[^\"\n]{0,200}\")?\)"
_ATTRIBUTES = r"(?P<attributes>(?:\s[^<>]{0,400})?)"
_KINDS: Mapping[str, str] = MappingProxyType({
    "formula": r"(?<![\w$\\])\$(?=[^\s$])(?P<inline>[^$\n]{1,300})(?<=\S)\$(?![0-9])|\$\$(?P<display>[^$]{1,500})\$\$"
    r"|\\\((?P<parenthesized>(?!\\\))[^\\\n]*(?:\\(?!\))[^\\\n]*){0,40})\\\)"
    r"|\\\[(?P<bracketed>(?!\\\])[^\\]*(?:\\(?!\])[^\\]*){0,40})\\\]"
    rf"|\\begin\{{{ENVIRONMENTS}\}}(?P<environment>(?!\\end)[^\\]*(?:\\(?!end\{{)[^\\]*){{0,40}})\\end\{{{ENVIRONMENTS}\}}",
    "token": r"<\|[\w ./:-]{1,40}\|>(?:(?<=start\|>)(?:assistant|user|system)\b)?|\[/?INST\]"
    r"|【[0-9:]{1,9}†[^【】\n]{0,80}】",
    "marked": r"(?<![=+\w])(?P<marker>==|\+\+)(?=[^\s=+][^=+\n]{0,200}(?<!\s)(?P=marker)(?![=+\w]))"
    r"|(?<=[^\s=+])(?:==|\+\+)(?![=+\w])",
    "reference": r"(?<![\w\]])!?\[(?=[^\[\]\n]{0,150}[^\W\d_][^\[\]\n]{0,150}\]\[[0-9]{0,3}\])"
    r"|(?<=[^\s\[])\]\[[0-9]{0,3}\]",
    "escape": r"\\[*_#\[\]()~`>|!{}<-]",
    "code": r"(?P<ticks>`{1,2})(?P<source>[^`\n]{1,500})(?P=ticks)|`+",
    "foreign": FOREIGN_MARK,
    "link": rf"!?\[(?=[^\[\]\n]{{0,300}}\]{_URL})|(?<=[^\s\[])\]{_URL}|\[\^[\w-]{{1,20}}\]:?|<(?=https?://[^<>\s]{{1,500}}>)",
    "entity": r"&(?:[A-Za-z][A-Za-z0-9]{1,31}|#[0-9]{1,7}|#[xX][0-9A-Fa-f]{1,6});",
    "tag": rf"<(?P<closing>/?)(?P<element>[A-Za-z][\w:.-]{{0,40}}){_ATTRIBUTES}\s?/?>",
    "struck": r"~~(?=\S)[^~\n]{1,300}~~",
    "square": r"(?P<around>[*_~]{1,3}|)\[(?P<squared>[^\[\]\n]{1,80})\](?P=around)(?!\()",
    "round": r"(?P<outside>[*_~]{1,3}|)\((?P<rounded>[^()\n]{1,80})\)(?P=outside)",
    "star": rf"(?<!{SPACED})(?<!\*)(?P<stars>\*{{1,3}})(?![\s*(\[])(?P<starred>[^*\n]{{1,80}})(?<!\s)(?P=stars)"
    rf"(?!{SPACED}|\*)",
    "line": r"(?<!\w)(?P<lines>_{1,2})(?![\s_])(?P<lined>[^_\n]{1,80})(?<!\s)(?P=lines)(?!\w)",
    "wave": r"(?<![\w~])~(?![\s~\d])(?P<waved>[^~\n]{1,80})(?<!\s)~(?![\w~])",
    "emoji": EMOJI,
    "hashtag": r"(?<![\w&#/])#(?=[^\W\d_])\w{1,100}",
})  # fmt: skip
_FORMULAS = ("inline", "display", "parenthesized", "bracketed", "environment")
_READ_BY_XML = frozenset(("escape", "code", "link", "entity", "tag", "struck", "hashtag"))
_VALUE = re.compile(r"(?:name|value|type|style|mood|emotion|kind)\s*=\s*[\"']?([\w -]{1,40})", re.IGNORECASE)
_LENGTH = re.compile(r"(?:time|duration|seconds|length|value)\s*=\s*[\"']?([0-9]{1,3}(?:\.[0-9]{1,3})?)\s*(ms|s)?")
_SENTENCE_START = re.compile(r"(?:\A|\n|\u2028|[.!?:…]['\"”’)]{0,3}\s)\s*\Z")
_CLAUSE_START = re.compile(r"[.!?:…,;—–-]['\"”’)]{0,3}\s*\Z")
_RIGHT_END = re.compile(rf"[ \t]*(?:\Z|[\n.!?…]|[\"“‘(\[*]?[^\W\d_a-zß-ÿ]|[\"“‘*_~\[<]|{EMOJI})")
_CLOSE_END = re.compile(r"[ \t]*(?:\Z|[\n.!?…])")
_SUBJECT = re.compile(r"(?:he|she|it|who|which|that|this|everyone|nobody)\s+\Z", re.IGNORECASE)  # she *looks* well
_CAPITAL_NOUNS = frozenset(("de", "lb"))  # languages in which capitals begin no sentence
_NEW_SENTENCE = re.compile(r"\s*[\"“‘]?(?!I\b)[^\W\d_a-zß-ÿ]")
_LAST_WORD = re.compile(r"([^\W\d_]+)[\"'”’)]?\s*\Z")
_CAMEL = re.compile(r"(?<=[a-z0-9])(?=[A-Z])|(?<=[A-Za-z])(?=[0-9])|_")
_MATHS = re.compile(r"(?:[0-9]|(?<![^\W_])(?!I\b)[A-Za-z])\s*\Z")
# m<sup>2</sup>, 10<sup>-3</sup>, not the sign of a note
_POWER = re.compile(r"(?<![^\W_])(?:[A-Za-z]|[kcm]m|ft|10|2)\Z")
_EXPONENT = re.compile(r"-?[0-9]{1,3}</sup>", re.IGNORECASE)
_GLUED = re.compile(r"[:;=]-?[()]")


@functools.lru_cache(maxsize=8)
def _pattern(emoticons: tuple[str, ...], left_out: frozenset[str] = frozenset()) -> "re.Pattern[str]":
    """All kinds of marks but some, each a group of its name; longer emoticons first."""
    longest = sorted(emoticons, key=len, reverse=True)
    written = "|".join(
        f"{re.escape(face)}(?![\\w\\\\/])" if face[-1].isalnum() else f"{re.escape(face)}(?!\\w)" for face in longest
    )
    kinds = {"own": OWN_MARK, "emoticon": rf"(?<![\w\\/])(?:{written})|{_GLUED.pattern}(?!\w)", **_KINDS}
    return re.compile("|".join(f"(?P<{kind}>{pattern})" for kind, pattern in kinds.items() if kind not in left_out))


def read_parts(text: str, rules: Rules) -> Iterator[Part]:
    """Parts of a text in order, which cover it; in linear time."""
    for _, parts in read_blocks(text, rules):
        yield from parts


def read_words(text: str, rules: Rules, before: str = "") -> Iterator[Part]:
    """Parts of words within SSML, whose parser has read tags and entities; `before` is the last character before."""
    scanner = _Scanner(text, rules, _READ_BY_XML)
    scanner.speak(before)
    yield from scanner.scan(0, len(text))


def read_blocks(text: str, rules: Rules) -> Iterator[tuple[Block, list[Part]]]:
    """Blocks of a text, with their parts."""
    scanner = _Scanner(text, rules)
    for block in split_blocks(text):
        parts: list[Part] = []
        for run in block.runs:
            if run.kind == "words":
                parts += scanner.scan(run.start, run.end)
            elif run.kind == "end":
                parts.append(End(run.start, run.end, run.value))
                scanner.tail = "\n"
            elif run.kind == "insert":
                parts.append(Text(run.start, run.end, run.value))
                scanner.speak(run.value)
            else:
                parts.append(Silent(run.start, run.end, run.value))
        yield block, parts


class _Scanner:
    """Finds the marks in runs of words."""

    def __init__(self, text: str, rules: Rules, left_out: frozenset[str] = frozenset()) -> None:
        self._text, self._rules = text, rules
        self._left_out = left_out
        self._has_marks = not PLAIN.fullmatch(text) or any(face in text for face in rules.table.plain_faces)
        self.tail = "\n"  # of what is spoken
        self._closing = -1  # of the delimiter that is open
        self._readers: Mapping[str, Callable[[re.Match[str]], Part | None]] = {
            "formula": self._formula,
            "token": lambda match: Silent(*match.span()),
            "marked": lambda match: self._delimited(match, match["marker"]),
            "reference": lambda match: self._delimited(match, None if match[0][0] == "]" else "]["),
            "escape": lambda match: Text(*match.span(), match[0][1]),
            "code": self._code,
            "foreign": self._foreign,
            "link": lambda match: Silent(*match.span()),
            "entity": self._entity,
            "tag": self._tag,
            "struck": lambda match: Silent(*match.span()),
            "square": lambda match: self._bracket(match, match["squared"]),
            "round": self._parenthesis,
            "star": lambda match: self._starred(match, match["starred"]),
            "line": lambda match: self._starred(match, match["lined"]),
            "wave": lambda match: self._starred(match, match["waved"]),
            "emoji": self._emoji,
            "emoticon": self._emoticon,
            "hashtag": self._hashtag,
            "own": self._own,
        }

    def scan(self, start: int, end: int) -> Iterator[Part]:
        """Parts of the words from `start` to `end`."""
        at = place = start
        before = self.tail
        while self._has_marks and (match := self._pattern.search(self._text, place, end)) is not None:
            self.tail = (before + self._text[max(at, match.start() - MAX_TAIL) : match.start()])[-MAX_TAIL:]
            part = self._readers[str(match.lastgroup)](match)
            if part is None:  # its first character is text, and behind it may be a mark
                place = match.start() + 1
                continue
            if match.start() > at:
                yield Text(at, match.start(), self._text[at : match.start()])
            if isinstance(part, Cue):
                part = replace(part, said=self._in_place_of(part))
            if isinstance(part, Text | Cue):
                self.speak(part.said)
            elif isinstance(part, End):
                self.tail = "\n"
            yield part
            at = place = part.end
            before = self.tail
        if end > at:
            self.tail = before
            self.speak(self._text[max(at, end - MAX_TAIL) : end])
            yield Text(at, end, self._text[at:end])

    @property
    def _pattern(self) -> "re.Pattern[str]":
        """All kinds of marks; it is not compiled for a text without signs of them, which takes 6 ms."""
        return _pattern(tuple(self._rules.table.marks["emoticon"]), self._left_out)

    def speak(self, said: str) -> None:
        """Follow what is spoken."""
        self.tail = (self.tail + said)[-MAX_TAIL:]

    def _in_place_of(self, cue: Cue) -> str:
        after = self._after(cue.end)
        has_capitals = self._rules.language.partition("-")[0] not in _CAPITAL_NOUNS
        if (
            cue.is_within
            and has_capitals
            and _NEW_SENTENCE.match(after)
            and (word := _LAST_WORD.search(self.tail)) is not None
        ):
            return ". " if not is_function_word(word[1]) else " "
        return " " if self.tail[-1:].isalnum() and after[:1].isalnum() else ""

    def _after(self, at: int) -> str:
        return self._text[at : at + MAX_TAIL]

    def _is_first(self) -> bool:
        return _SENTENCE_START.search(self.tail) is not None

    def _own(self, match: "re.Match[str]") -> Part | None:
        if match["gesture"] is None:
            if match["name"] and not match["end"]:
                note = f"the mark [{match['name']} has no closing bracket; its words are spoken"
                return Silent(match.start(), match.start() + 1, note)
            return Own(*match.span(), match)
        if not match["gesture_end"]:
            return None
        if self._text[match.end() : match.end() + 1] == "(":  # the label of a link
            return Silent(match.start(), match.start() + 1)
        if is_gesture(match["gesture"]):
            return Own(*match.span(), match)
        return self._bracket(match, match["gesture"])

    def _foreign(self, match: "re.Match[str]") -> Part | None:
        """A mark of another markup, whose words are spoken; the end of a direction ends its style."""
        ended = match["ended"]
        if ended and self._direction(ended, is_strict=False) is not None:
            return Cue(*match.span(), (), ends_style=True)
        if ended and ended.casefold() not in PASSED:
            return None  # [/tmp]
        return Silent(*match.span(), f"the mark {match[0][:MAX_QUOTED_CHARACTERS]} is not followed; its text is spoken")

    def _formula(self, match: "re.Match[str]") -> Part | None:
        written = next(found for name in _FORMULAS if (found := match[name]) is not None)
        if match["inline"] is not None and not is_formula(written):
            return None
        said = formula_words(written, self._rules.language)
        return Text(*match.span(), f"{' ' * self.tail[-1:].isalnum()}{said}")

    def _delimited(self, match: "re.Match[str]", closing: str | None) -> Part | None:
        """A delimiter that is silent: one that opens, with the place of its end, or that end."""
        if closing is None:
            return Silent(*match.span()) if match.start() == self._closing else None
        self._closing = self._text.find(closing, match.end())
        return Silent(*match.span())

    def _code(self, match: "re.Match[str]") -> Part:
        return Text(*match.span(), match["source"].strip()) if match["source"] else Silent(*match.span())

    def _entity(self, match: "re.Match[str]") -> Part | None:
        said = html.unescape(match[0])
        return None if said == match[0] else Text(*match.span(), said.replace("\xa0", " "))

    def _hashtag(self, match: "re.Match[str]") -> Part | None:
        words = _CAMEL.sub(" ", match[0][1:])
        if not self._rules.language.startswith("en"):
            return Text(*match.span(), words)
        # the front end reads #FF8800
        return None if is_color(match[0]) else Text(*match.span(), " ".join(map(tag_words, words.split())))

    def _emoji(self, match: "re.Match[str]") -> Part:
        mark = self._rules.table.emoji(match[0])
        word = emoji_word(match[0], mark, self.tail, self._after(match.end()), self._rules.language)
        if word:
            return Text(*match.span(), f" {word} " if self.tail[-1:].isalnum() else f"{word} ")
        return Cue(*match.span(), (mark,) if mark else (), is_within=True)

    def _emoticon(self, match: "re.Match[str]") -> Part | None:
        mark = self._rules.table.emoticon(match[0])
        if mark is None:
            return None
        is_glued = self.tail[-1:].isalnum()
        if is_glued and (not _GLUED.fullmatch(match[0]) or "(" in self.tail):
            return None
        if match[0][0] in "<:=" and _MATHS.search(self.tail) and not _GLUED.match(match[0]):
            return None
        if mark.word:
            return self._emoji(match) if self._rules.table.emoji(match[0]) else self._loved(match, mark)
        return Cue(*match.span(), (mark,), is_within=True)

    def _loved(self, match: "re.Match[str]", mark: TextMark) -> Part:
        word = emoji_word(match[0], mark, self.tail, self._after(match.end()), self._rules.language)
        return Text(*match.span(), f"{word} ") if word else Cue(*match.span(), (mark,), is_within=True)

    def _bracket(self, match: "re.Match[str]", words: str) -> Part | None:
        found = self._direction(words, is_strict=False)
        return None if found is None else Cue(*match.span(), found.marks)

    def _parenthesis(self, match: "re.Match[str]") -> Part | None:
        words = match["rounded"]
        found = self._direction(words, is_strict=True)
        if found is None:
            return None
        is_attribute = not found.is_verb and (word := _LAST_WORD.search(self.tail)) and is_function_word(word[1])
        stands_alone = _CLAUSE_START.search(self.tail) or self._is_first() or _CLOSE_END.match(self._after(match.end()))
        is_exclaimed = "!" in words  # (looks!) is said, but where it stands alone
        is_model = self._rules.is_model and not is_attribute and not is_exclaimed
        shows = any(mark.gesture or mark.style or mark.pause_s for mark in found.marks)
        if not (stands_alone or is_model or (found.is_verb and shows and " " not in words)):
            return None
        return Cue(*match.span(), found.marks)

    def _starred(self, match: "re.Match[str]", words: str) -> Part | None:
        found = self._direction(words, is_strict=False)
        if found is None or _SUBJECT.search(self.tail):
            return None
        after, is_first = self._after(match.end()), self._is_first()
        ends = _RIGHT_END.match(after) is not None
        if not found.is_verb:
            is_alone = is_first and ends
        elif any(mark.gesture or mark.style for mark in found.marks):
            is_alone = True
        else:
            is_alone = is_first or ends or _CLAUSE_START.search(self.tail) is not None
        return Cue(*match.span(), found.marks) if is_alone else None

    def _direction(self, words: str, *, is_strict: bool) -> Direction | None:
        return find_direction(words.strip(" *_~"), self._rules.table, is_first=self._is_first(), is_strict=is_strict)

    def _tag(self, match: "re.Match[str]") -> Part | None:
        name, attributes = match["element"].casefold().rpartition(":")[2], match["attributes"]
        span, closing = match.span(), bool(match["closing"])
        if name in BREAKS:
            return End(*span, BREAKS[name])
        if name in PAUSE_TAGS:
            return Silent(*span) if closing else Cue(*span, (_pause(attributes, PAUSE_TAGS[name]),))
        if name in MOOD_TAGS:
            value = _VALUE.search(attributes)
            found = self._direction(f"emotion: {value[1]}", is_strict=False) if value else Direction()
            return Cue(*span, found.marks if found and not closing else (), ends_style=closing)
        found = self._direction(name.replace("_", " ").replace("-", " "), is_strict=False)
        if found is not None and not attributes.strip(" /"):
            return Cue(*span, () if closing else found.marks, ends_style=closing)
        return self._other_tag(match, name)

    def _other_tag(self, match: "re.Match[str]", name: str) -> Part | None:
        """A tag without an effect here, or words between < and >."""
        span, closing = match.span(), bool(match["closing"])
        attributes = match["attributes"]
        shown = " ".join(match[0][:MAX_QUOTED_CHARACTERS].split())
        if name == "sup" and _POWER.search(self.tail) and _EXPONENT.match(self._after(match.end())):
            return Text(*span, "^")
        if name in PASSED:
            is_noted = name in UNFOLLOWED and not closing
            return Silent(*span, f"{shown} is followed within <speak> alone; its text is spoken" if is_noted else "")
        before, after = self.tail[-1:], self._after(match.end())[:1]
        words = attributes.strip(" /")
        wraps = self._is_first() or after.isalnum()  # not <name> in a letter
        if closing or "=" in attributes or match[0].endswith("/>") or (self._rules.is_model and wraps and not words):
            return Silent(*span, "" if closing else f"{shown} is no tag that is known; the text behind it is spoken")
        if words and (before.isalnum() or after.isalnum()):  # x<y then y>x
            return None
        return Text(
            *span, f"{' ' * before.isalnum()}{match[0][1:-1]}{' ' * after.isalnum()}"
        )  # <order number>, List<T>


def _pause(attributes: str, usual: float) -> TextMark:
    length = _LENGTH.search(attributes)
    seconds = float(length[1]) / (1000 if length[2] == "ms" else 1) if length else usual
    return TextMark("pause", "tag", pause_s=min(seconds, 10.0))
