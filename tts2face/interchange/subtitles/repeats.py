"""Words that are shown again: copies at one time, and lines that roll, scroll or grow from cue to cue.

Rolling captions show a line when it is new, and again while the next one is spoken; conversions of them to cues hold
each word several times. A repetition in speech ("No." "No.", a chorus) carries no line to a cue of more words, and
stays.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, groupby

from tts2face.interchange.subtitles.clock import parse_clock
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import plain_text
from tts2face.interchange.subtitles.spoken_text import spoken_text
from tts2face.interchange.subtitles.unspoken import SIGNS, as_text

MAX_GAP_S = 0.2  # between a cue and the one that takes over its lines
HOLD_S = 0.055  # a cue up to two frames long shows words, but is too short to say any
SURE_WORDS = 4  # carried by a single cue in a file that does not roll
RUN_WORDS = 3  # carried by two cues in such a file
SAME_S = 0.1  # within which copies begin
_INSTANT = re.compile(r"<(\d[\d:.,]*:\d[\d:.,]*)>")
_PLACED = re.compile(r"\{[^{}]*\\(?:pos|move)\s*\(")  # in SubStation Alpha
_MARK = re.compile(r"</?[A-Za-z][^<>]*>|\{\\[^{}]*\}")
_OUTER_MARKS = re.compile(rf"^(?:{_MARK.pattern}|\s)+|(?:{_MARK.pattern}|\s)+$")
_LYRICS = re.compile("[♪♫♬♩]")
_MARKS = re.compile(r"[^\w]+")
_SENTENCE_END = re.compile(r"[.!?…。！？][\"'”’»)\]]*$")
WORDS_PER_S = 8.0  # said at most


@dataclass(frozen=True, slots=True)
class _Step:
    """Words that a cue takes over from the cue before it.

    `n_carried` counts words; `is_strong` says that the step is one of rolling captions and no repetition in speech;
    `may_be_said`, that the words are whole sentences, which the cue before was long enough to say.
    """

    n_carried: int = 0
    is_strong: bool = False
    is_sure: bool = False
    is_frame: bool = False
    may_be_said: bool = False


def without_copies(cues: Sequence[WrittenCue], warnings: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues in order of time, of which those with equal words at one time are one.

    Lines of two named speakers are two. Of a copy with a name and one without, the name stays.
    """
    kept: list[WrittenCue] = []
    speakers: list[str] = []
    copies: list[WrittenCue] = []
    latest: dict[str, int] = {}
    for cue, is_alone in zip(cues, _are_alone(cues), strict=True):
        if is_alone:
            kept.append(cue)
            speakers.append(cue.speaker)
            continue
        text = spoken_text(cue.text, cue.markup)
        words = _MARKS.sub(" ", text.spoken or text.shown).casefold().strip()
        speaker = cue.speaker or text.speaker
        at = latest.get(words)
        if words and at is not None and _is_copy((kept[at], speakers[at]), (cue, speaker)):
            copies.append(cue)
            if not speakers[at] and speaker:
                kept[at] = replace(cue, begin_s=kept[at].begin_s, line=kept[at].line)
                speakers[at] = speaker
            continue
        latest[words] = len(kept)
        kept.append(cue)
        speakers.append(speaker)
    if copies:
        number = f"{len(copies)} cues repeat others" if len(copies) > 1 else "this cue repeats another one"
        warnings.append(
            SubtitleWarning(copies[0].line, f"{number} of the same time; what is shown twice is spoken once")
        )
    return kept


def _are_alone(cues: Sequence[WrittenCue]) -> list[bool]:
    """Whether each cue is shown while no other one is."""
    alone = [True] * len(cues)
    longest = 0
    for number, cue in enumerate(cues):
        if number and (cue.begin_s < (cues[longest].end_s or 0.0) or cue.begin_s - cues[number - 1].begin_s < SAME_S):
            alone[number] = alone[number - 1] = alone[longest] = False
        if (cue.end_s or cue.begin_s) > (cues[longest].end_s or 0.0):
            longest = number
    return alone


def _is_copy(former: tuple[WrittenCue, str], other: tuple[WrittenCue, str]) -> bool:
    """Whether a cue with the words of a former one, each with its speaker, is shown together with it."""
    (first, speaker), (second, other_speaker) = former, other
    if speaker and other_speaker and speaker.casefold() != other_speaker.casefold():
        return False
    if abs(second.begin_s - first.begin_s) < 1e-6:
        return True
    ends = first.end_s or 0.0, second.end_s or 0.0
    shared = min(ends) - second.begin_s
    shorter = min(ends[0] - first.begin_s, ends[1] - second.begin_s)
    return shared > 0.0 and (abs(second.begin_s - first.begin_s) <= SAME_S or shared >= 0.8 * shorter > 0.0)


def without_carried(cues: Sequence[WrittenCue], notes: list[SubtitleWarning]) -> list[WrittenCue]:
    """Cues in order of time with the words that are new in each; a cue without new words lengthens the one before."""
    shown = [_lines(cue) for cue in cues]
    steps = _accepted(_steps(cues, shown))
    kept: list[WrittenCue] = []
    n_carried, first = 0, 0
    for cue, lines, step in zip(cues, shown, steps, strict=True):
        if not step.n_carried:
            kept.append(cue)
            continue
        if step.is_frame and kept and all(_PLACED.search(shown.text) for shown in (kept[-1], cue)):
            # frame by frame writing follows the picture
            kept[-1] = replace(kept[-1], end_s=cue.end_s, kind=kept[-1].kind or SIGNS)
            continue
        n_carried += 1
        first = first or cue.line
        text = _after(lines, step.n_carried)
        if text:
            kept.append(replace(as_text(cue, text), begin_s=_new_begin(cue, step.n_carried)))
        elif kept and cue.end_s is not None:
            kept[-1] = replace(kept[-1], end_s=max(cue.end_s, kept[-1].end_s or 0.0))
    if n_carried:
        notes.append(
            SubtitleWarning(
                first,
                f"rolling captions: {n_carried} of {len(cues)} cues show words of the cue before them again; each word "
                "is spoken once, from the cue in which it is new (--keep repeats speaks all)",
            )
        )
    return kept


def _lines(cue: WrittenCue) -> list[list[str]]:
    return [words for line in plain_text(cue.text, cue.markup).split("\n") if (words := line.split())]


def _steps(cues: Sequence[WrittenCue], shown: Sequence[Sequence[Sequence[str]]]) -> list[_Step]:
    steps = []
    before = None
    for number, (cue, lines) in enumerate(zip(cues, shown, strict=True)):
        if not lines:
            steps.append(_Step())
            continue
        steps.append(_Step() if before is None else _step(cues[before], cue, shown[before], lines))
        before = number
    return steps


def _step(before: WrittenCue, cue: WrittenCue, old: Sequence[Sequence[str]], new: Sequence[Sequence[str]]) -> _Step:
    """Words taken over from the lines before: from one of these lines on, all words begin the cue."""
    begins_late = before.end_s is not None and cue.begin_s - before.end_s > MAX_GAP_S
    if begins_late or before.speaker != cue.speaker or cue.begin_s - before.begin_s < 1e-6:
        return _Step()
    words = [word.casefold() for line in new for word in line]
    for first in range(len(old)):
        tail = [word.casefold() for line in old[first:] for word in line]
        if tail == words[: len(tail)]:
            break
    else:
        return _Step()
    n_new = len(words) - len(tail)
    length = None if cue.end_s is None else cue.end_s - cue.begin_s
    is_frame = not n_new and length is not None and 0.0 < length <= HOLD_S
    is_marked = not n_new and first == 0 and len(words) > 1 and _is_highlight(before.text, cue.text)
    is_hold = is_frame or is_marked
    is_moved = (n_new > 0 or first > 0) and len(set(words)) > 1
    is_sung = any(_LYRICS.search(word) for word in words)
    gap = 0.0 if before.end_s is None else cue.begin_s - before.end_s
    is_sure = is_hold or (is_moved and len(tail) >= SURE_WORDS and abs(gap) <= HOLD_S and not is_sung)
    n_seconds = cue.begin_s - before.begin_s
    # several words of a whole line are what rolling captions carry
    is_line = len(tail) >= SURE_WORDS and len(tail) in accumulate(map(len, new))
    is_sentence = _SENTENCE_END.search(tail[-1]) is not None and not is_line
    may_be_said = not is_hold and is_sentence and n_seconds >= len(tail) / WORDS_PER_S
    return _Step(len(tail), is_hold or is_moved, is_sure, is_frame, may_be_said)


def _is_highlight(former: str, text: str) -> bool:
    """Whether texts of the same words mark different ones: word by word, as recognisers of speech and karaoke do."""
    return former != text and any(_MARK.search(_OUTER_MARKS.sub("", written)) for written in (former, text))


def _accepted(steps: Sequence[_Step]) -> list[_Step]:
    """Steps of rolling captions: runs, single ones that are sure, and all where most cues roll."""
    n_strong = sum(step.is_strong for step in steps)
    if n_strong >= 3 and n_strong >= 0.5 * (len(steps) - 1):
        return list(steps)
    accepted: list[_Step] = []
    for is_strong, group in groupby(steps, lambda step: step.is_strong and not step.may_be_said):
        run = list(group)
        is_run = is_strong and len(run) > 1 and (len(run) > 2 or sum(step.n_carried for step in run) >= RUN_WORDS)
        accepted += [step if is_run or (step.is_sure and not step.may_be_said) else _Step() for step in run]
    return accepted


def _after(lines: Sequence[Sequence[str]], n_words: int) -> str:
    """Text of lines after their first words."""
    kept = []
    for line in lines:
        kept.append(" ".join(line[n_words:]))
        n_words = max(n_words - len(line), 0)
    return "\n".join(line for line in kept if line)


def _new_begin(cue: WrittenCue, n_carried: int) -> float:
    """Seconds at which the first new word begins: an instant within the cue that stands before it, else its start."""
    start = cue.begin_s
    for match in _INSTANT.finditer(cue.text):
        n_before = len(plain_text(cue.text[: match.start()], cue.markup).split())
        at = parse_clock(match[1])
        if n_before == n_carried and at is not None and start <= at < (cue.end_s or at):
            return at
    return start
