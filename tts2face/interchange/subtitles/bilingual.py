"""Files that show every line in two languages, one below the other or in cues of the same time: one is spoken."""

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from lexicon.g2p import DEFAULT_LANGUAGE
from lexicon.scripts import language_scripts, letter_script
from lexicon.text_language import common_words, guess_language
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import plain_text
from tts2face.interchange.subtitles.unspoken import as_text

MIN_CUES = 3
MIN_SHARE = 0.6  # of the instants of a file that show two texts: fewer are quotations of another language
SCRIPT_SHARE = 0.8  # of the two texts of an instant that have the writing systems of the file
WORDS_SHARE, WORDS_RATIO = 0.3, 3.0  # common words of a language for each text of it, and for each one of the other
SAME_S = 1e-3
_LATIN = "LATIN"
_EAST_ASIAN = frozenset({"CJK", "HIRAGANA", "KATAKANA"})
_WORDS_OF_LETTERS = re.compile(r"[^\W\d_]+")
_Line = tuple[int, str]  # number of the cue, and text


@dataclass(frozen=True, slots=True)
class _Language:
    """One of the two languages of a file: its tag as far as it is known, and its writing system."""

    tag: str
    script: str


def in_one_language(cues: Sequence[WrittenCue], language: str | None, notes: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues in order of time, where all show two languages with the lines of one.

    It is `language`, if it is one of them, else English or the first one.
    """
    stacks = [stack for stack in _stacks(cues) if stack is not None]
    n_instants = sum(1 for _ in _instants(cues))
    if len(stacks) < MIN_CUES or len(stacks) < MIN_SHARE * n_instants:
        return list(cues)
    found = _languages(stacks)
    if found is None:
        return list(cues)
    at = _chosen(found, language)
    lines: dict[int, list[str]] = {}
    for stack in stacks:
        for number, _ in stack[1 - at]:
            lines.setdefault(number, [])
        for number, text in stack[at]:
            lines.setdefault(number, []).append(text)
    kept = [
        cue if number not in lines else as_text(cue, "\n".join(lines[number]))
        for number, cue in enumerate(cues)
        if number not in lines or lines[number]
    ]
    message = (
        f"two languages: {len(stacks)} cues are shown in {_name(found[0])} and in {_name(found[1])}, of which "
        f"{_name(found[at])} is spoken (--language names the other one, --keep repeats speaks both)"
    )
    notes.append(SubtitleWarning(cues[stacks[0][0][0][0]].line, message))
    return kept


def _instants(cues: Sequence[WrittenCue]) -> Iterator[list[_Line]]:
    """Lines with words of the cues of each start."""
    for _, group in groupby(enumerate(cues), key=lambda numbered: round(numbered[1].begin_s / SAME_S)):
        lines = [
            (number, line)
            for number, cue in group
            if not cue.kind
            for line in plain_text(cue.text, cue.markup).split("\n")
            if any(map(str.isalpha, line))
        ]
        if lines:
            yield lines


def _stacks(cues: Sequence[WrittenCue]) -> Iterator[tuple[list[_Line], list[_Line]] | None]:
    """The two texts of each instant, or None where it does not show two."""
    for lines in _instants(cues):
        numbers = list(dict.fromkeys(number for number, _ in lines))
        scripts = [_script(text) for _, text in lines]
        changes = [place for place in range(1, len(lines)) if scripts[place] != scripts[place - 1]]
        if len(numbers) == 2:
            place = sum(number == numbers[0] for number, _ in lines)
        elif len(numbers) == 1 and len(changes) == 1:
            place = changes[0]
        else:
            place = len(lines) // 2 if len(numbers) == 1 and not changes and len(lines) % 2 == 0 else 0
        yield (lines[:place], lines[place:]) if place else None


def _script(text: str) -> str:
    """Writing system of most letters of a text."""
    scripts = Counter(letter_script(letter) for letter in text if letter.isalpha())
    found = scripts.most_common(1)[0][0] if scripts else ""
    return "CJK" if found in _EAST_ASIAN else found


def _languages(stacks: Sequence[tuple[list[_Line], list[_Line]]]) -> tuple[_Language, _Language] | None:
    """Languages of the first and second texts; None where they are not clearly two."""
    texts = [["\n".join(text for _, text in half) for half in stack] for stack in stacks]
    pairs = Counter((_script(first), _script(second)) for first, second in texts)
    scripts, n_same = pairs.most_common(1)[0]
    joined = ["\n".join(text[side] for text in texts) for side in (0, 1)]
    tags = [guess_language(text) for text in joined]
    found = _Language(tags[0], scripts[0]), _Language(tags[1], scripts[1])
    if scripts[0] != scripts[1]:
        return found if n_same >= SCRIPT_SHARE * len(stacks) else None
    if scripts[0] != _LATIN or _base(tags[0]) == _base(tags[1]):
        return None
    own = common_words(tags[0]) - common_words(tags[1]), common_words(tags[1]) - common_words(tags[0])
    for side, text in enumerate(joined):
        words = _WORDS_OF_LETTERS.findall(text.lower())
        n_own, n_other = (sum(word in own[place] for word in words) for place in (side, 1 - side))
        if n_own < max(2.0, WORDS_SHARE * len(stacks)) or n_own < WORDS_RATIO * n_other:
            return None
    return found


def _chosen(found: tuple[_Language, _Language], language: str | None) -> int:
    """Which of two languages is spoken."""
    wanted = _base(language or DEFAULT_LANGUAGE)
    named = [side for side in (0, 1) if _base(found[side].tag) == wanted]
    readable = [side for side in (0, 1) if found[side].script in language_scripts(wanted)]
    english = [side for side in (0, 1) if _base(found[side].tag) == "en"]
    return next((sides[0] for sides in (named, readable, english) if len(sides) == 1), 0)


def _base(tag: str) -> str:
    base = tag.casefold().replace("_", "-").partition("-")[0]
    return {"zh": "cmn", "yue": "cmn"}.get(base, base)


def _name(language: _Language) -> str:
    return f"{_base(language.tag)!r}"
