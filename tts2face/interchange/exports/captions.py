"""Captions of a clip: WebVTT and SubRip, by sentence or word, and WebVTT with a time before each word."""

import re
import textwrap
from collections.abc import Iterator, Sequence
from difflib import SequenceMatcher

from lexicon.normalize import split_tokens
from lexicon.sources import english_groups
from tts2face.interchange.exports.labels import Label, part_words
from tts2face.interchange.exports.parts import Part, Target

MAX_LINE_CHARACTERS = 42  # of a line of captions, a common limit of subtitling guides
MAX_CUE_CHARACTERS = 2 * MAX_LINE_CHARACTERS
MAX_CUE_S = 7.0  # longest cue of the same guides
MIN_PAUSE_S = 0.3  # silence that ends a cue where the written text is unknown
_TOKEN = re.compile(r"\S+\s*")
_PIECE = re.compile(
    r"[^、。，！？；：]{1,10}[、。，！？；：」』]*\s*|[、。，！？；：」』]+\s*"
)  # a break after punctuation
_VTT_ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;"})


def sentence_cues(words: Sequence[Label], text: str) -> list[list[Label]]:
    """Cues of a part, each as a list of timed tokens with the space after them; at most two lines and `MAX_CUE_S`.

    Parameters
    ----------
    words
        Words as they are written or spoken.
    text
        Written text of the part; where its tokens are not the spoken words (``$3.50``), their times are taken from the
        words at the same share of the letters. If empty, the words are the text, and pauses end cues.
    """
    if not words:
        return []
    if text.strip():
        tokens = _timed_tokens(words, written_tokens(text))
    else:
        tokens = [Label(f"{word.text} ", word.start, word.end) for word in words]
    cues: list[list[Label]] = [[]]
    for token in tokens:
        cue = cues[-1]
        if cue and _ends_cue(cue, token, has_text=bool(text.strip())):
            cues.append([])
        cues[-1].append(token)
    return cues


def written_words(words: Sequence[Label], text: str) -> list[Label]:
    """Words as they are written ($3.50), each with the time of all its spoken words; those of a clip without a text.

    Clips of other languages than English have written words already.
    """
    if not words or not text.strip():
        return list(words)
    groups = english_groups([word.text for word in words], list(split_tokens(text)), text)
    return [
        Label(written, words[at[0]].start, words[at[-1]].end, min(words[k].confidence for k in at))
        for written, at in groups
    ]


def written_tokens(text: str) -> list[str]:
    """Tokens of a text with the space after them; text without spaces (Chinese, Japanese, Thai) is divided further."""
    tokens: list[str] = []
    for token in _TOKEN.findall(text):
        tokens += [token] if len(token) <= MAX_LINE_CHARACTERS else _PIECE.findall(token)
    return tokens


def _ends_cue(cue: Sequence[Label], token: Label, *, has_text: bool) -> bool:
    n_characters = sum(len(label.text) for label in cue) + len(token.text.rstrip())
    is_pause = not has_text and token.start - cue[-1].end >= MIN_PAUSE_S
    return is_pause or n_characters > MAX_CUE_CHARACTERS or token.end - cue[0].start > MAX_CUE_S


def _timed_tokens(words: Sequence[Label], tokens: Sequence[str]) -> list[Label]:
    """Written tokens with the times of the spoken words: equal words first, then by shares of letters between them."""
    matcher = SequenceMatcher(None, [_plain(token) for token in tokens], [_plain(word.text) for word in words], False)
    timed: list[Label] = []
    at_token = at_word = 0
    for token, word, size in matcher.get_matching_blocks():
        timed += _shared_times(words[at_word:word], tokens[at_token:token], timed, words[word : word + 1])
        matched = zip(tokens[token : token + size], words[word : word + size], strict=True)
        timed += [Label(written, spoken.start, spoken.end) for written, spoken in matched]
        at_token, at_word = token + size, word + size
    return timed


def _plain(text: str) -> str:
    """Letters and digits of a text in lower case."""
    return "".join(character for character in text.casefold() if character.isalnum())


def _shared_times(
    words: Sequence[Label], tokens: Sequence[str], before: Sequence[Label], after: Sequence[Label]
) -> list[Label]:
    """Tokens that are none of the words, over the time of the words between the same neighbours.

    Without words between them, the tokens (a dash, a symbol that is not spoken) have the time of the pause there.
    """
    if not tokens:
        return []
    if not words:
        start = before[-1].end if before else after[0].start
        end = after[0].start if after else start
        return [Label(token, start, max(start, end)) for token in tokens]
    shares = _shares([word.text for word in words])
    timed = []
    for token, (first, last) in zip(tokens, _shares(tokens), strict=True):
        covered = [number for number, (first_start, end) in enumerate(shares) if first_start < last and end > first]
        at, until = covered[0], covered[-1]
        first_start, finish = _within(words[at], shares[at], first), _within(words[until], shares[until], last)
        timed.append(Label(token, first_start, finish))
    return timed


def _shares(texts: Sequence[str]) -> list[tuple[float, float]]:
    """Start and end of each text as shares of all letters."""
    total, at = sum(len(text) for text in texts), 0
    shares = []
    for text in texts:
        shares.append((at / total, (at + len(text)) / total))
        at += len(text)
    return shares


def _within(word: Label, span: tuple[float, float], share: float) -> float:
    """Time within a word at a share of all letters."""
    first_start, end = span
    part = min(max((share - first_start) / (end - first_start), 0.0), 1.0)
    return word.start + part * (word.end - word.start)


def _clock(seconds: float, decimal: str) -> str:
    total = round(seconds * 1000)
    return f"{total // 3_600_000:02d}:{total // 60_000 % 60:02d}:{total // 1000 % 60:02d}{decimal}{total % 1000:03d}"


def _lines(tokens: Sequence[Label]) -> str:
    text = re.sub(r"\s+", " ", "".join(token.text for token in tokens)).strip()
    return "\n".join(textwrap.wrap(text, MAX_LINE_CHARACTERS, break_on_hyphens=False) or [text])


class _CaptionWriter:
    """Writes cues as clips arrive."""

    decimal = "."
    heading = "WEBVTT\n\n"
    has_numbers = False

    def __init__(self, target: Target) -> None:
        self._file = target.path.open("w", encoding="utf-8", newline="\n")
        self._file.write(self.heading)
        self._n_cues = 0

    def add(self, part: Part) -> None:
        """Append the cues of a part."""
        for tokens in self.cues(written_words(part_words(part), part.text), part.text):
            self._n_cues += 1
            start, end = (_clock(time, self.decimal) for time in (tokens[0].start, tokens[-1].end))
            number = f"{self._n_cues}\n" if self.has_numbers else ""
            self._file.write(f"{number}{start} --> {end}\n{self.content(tokens)}\n\n")

    def finish(self) -> None:
        """Complete the file."""
        self._file.close()

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def cues(self, words: Sequence[Label], text: str) -> list[list[Label]]:
        """Cues of a part as lists of tokens."""
        return sentence_cues(words, text)

    def content(self, tokens: Sequence[Label]) -> str:
        """Text of a cue."""
        return _lines(tokens).translate(_VTT_ESCAPES)


class SentenceVttWriter(_CaptionWriter):
    """WebVTT by sentence."""


class KaraokeVttWriter(_CaptionWriter):
    """WebVTT by sentence with a timestamp before each token but the first (WebVTT section 4.2.2)."""

    def content(self, tokens: Sequence[Label]) -> str:
        """Text of a cue on one line, with timestamps that increase within the cue."""
        return re.sub(r"\s+", " ", "".join(self._marked(tokens))).strip()

    def _marked(self, tokens: Sequence[Label]) -> Iterator[str]:
        before = _clock(tokens[0].start, self.decimal)
        for token in tokens:
            time = _clock(token.start, self.decimal)
            mark = f"<{time}>" if time > before else ""
            yield mark + token.text.translate(_VTT_ESCAPES)
            before = max(before, time)


class WordVttWriter(_CaptionWriter):
    """WebVTT by word."""

    def cues(self, words: Sequence[Label], text: str) -> list[list[Label]]:
        """Each word as a cue."""
        return [[word] for word in words]


class SentenceSrtWriter(_CaptionWriter):
    """SubRip by sentence."""

    decimal = ","
    heading = ""
    has_numbers = True

    def content(self, tokens: Sequence[Label]) -> str:
        """Text of a cue; SubRip has no escapes."""
        return _lines(tokens)


class WordSrtWriter(SentenceSrtWriter):
    """SubRip by word."""

    def cues(self, words: Sequence[Label], text: str) -> list[list[Label]]:
        """Each word as a cue."""
        return [[word] for word in words]
