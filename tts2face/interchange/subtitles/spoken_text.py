"""The spoken words of a cue, and its speaker's label."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass

from lexicon.inline_marks import read_parts
from lexicon.mark_parts import Cue, Own, Rules, Silent
from lexicon.text_marks import has_words, is_ssml
from tts2face.interchange.subtitles.cues import CuePart
from tts2face.interchange.subtitles.labels import divided_at_labels, split_label, without_manners
from tts2face.interchange.subtitles.markup import SUBRIP_MARKUP, Markup, plain_text
from tts2face.interchange.subtitles.unspoken import ANNOTATIONS, LYRICS

# Additions of subtitles for the deaf: noises in brackets, lyrics between notes.
# Brackets in a word or around digits are said: Parent(s), (s)he, f(x), (555); so are comparisons. A noise that follows
# a word without a space is known by its words. Brackets that are not closed end with their line.
_NOISE = (
    r"(?:laugh|chuckle|giggle|snicker|sigh|gasp|groan|moan|cough|sneeze|sniff|sniffle|sob|weep|scream|shout|yell|"
    r"whisper|mutter|mumble|grunt|pant|exhale|inhale|breathe|gulp|hum|whistle|clap|cheer|pause|applaud|stammer|snort|"
    r"yawn|shush|growl|hiss|wail|whimper|burp|hiccup|click|knock|beep)(?:e?s|e?d|ing)?|cries|crying|sings|singing|"
    r"(?:laugh|chuckl|giggl|sneez|sniffl|mumbl|exhal|inhal|breath|whistl|paus)ing|laughter|applause|music|silence|"
    r"inaudible|unintelligible|indistinct|crosstalk|static|lacht|seufzt|hustet|flüstert|rires?|soupirs?|risas?|"
    r"suspira|ride|sospira|сме[её]тся|вздыхает|кашляет|плачет|кричит|шепчет|смех|пауза|музыка"
)
_GLUED = r"(?<=[A-Za-zÀ-ɏͰ-ӿ\d])"
_GLUED_NOISE = rf"{_GLUED}[\[(](?:(?i:{_NOISE})|[^\W\d_]{{2,}}(?:[ ’'-][^\W\d_]{{2,}}){{1,5}})[\])]"
_SQUARE = r"\[(?:[^\[\]\n]|\[[^\[\]\n]*\])*\]|\[[^\[\]]*\]|\[[^\[\]\n]*"
_SAID_IN_ROUND = r"\d+\)|[A-Za-zÀ-ɏ]{1,3}\)[a-zß-ɏ]|[^()\n]{0,60}\w ?[<>=]{1,2} ?\w"
_FACE = r"(?:(?<=[:;=]\()|(?<=[:;=]-\())(?:\s|$)"  # :-(
_ROUND = rf"\((?!{_FACE}|{_SAID_IN_ROUND})(?:(?:[^()]|\([^()]*\))*\)|(?=[^\W\d_])[^()\n]*(?=\n|\Z))"
_ANNOTATION = re.compile(
    rf"{_GLUED.replace('<=', '<!')}(?:{_SQUARE}|{_ROUND})|{_GLUED_NOISE}"
    r"|（[^（）]*）|【[^【】]*】|［[^［］]*］|[（【［][^（）【】［］\n]*(?=\n|\Z)"
    r"|\A[^\[\]\n]{0,60}[^\W\d_]\](?!\w)"  # of a noise that begins in the cue before
)
# Notes that are not closed end before a line of somebody.
_TURN = r"\n\s*(?:[-–—‐]|>>|[^\W\d_a-z][^\s:]{0,30}(?:[^\S\n][^\W\d_a-z][^\s:]{0,30})?:\s)"
_LYRICS = re.compile(rf"[♪♫♬♩]+(?:(?!{_TURN})[^♪♫♬♩])*[♪♫♬♩]*|(?m:^[^\S\n]*#\s.*(?:\s#)?\s*$)")
_BRACKETS = re.compile(r"[\[\]()（）【】［］]")
_NOTES = re.compile(r"[♪♫♬♩]|(?m:^[^\S\n]*#\s|\s#\s*$)")
_DASH = re.compile(r"^\s*(?:[-–—‐](?![\d.,]*\d|[$€£]\d)\s*(?=\S)|>{2,3}\s*|•\s*)", re.MULTILINE)  # -5 is a number
_DASHED_NUMBER = re.compile(r"^(\s*[-–—‐])(?=\d|[$€£]\d)")
_INNER_DASH = re.compile(r"(?<!\s)\s++(?=(?P<dash>[-–—‐]|>{2,3})\s*[\"'“‘«¿¡….(\[]{0,4}(?P<letter>\w))")
_ENDS_SENTENCE = re.compile(r"[.!?…♪。！？؟۔।][\"'”’»)\]]*\s*$")
_END_CHARACTERS = 8  # of a line, within which the end of its last sentence lies
_VOICE = re.compile(r"<v(?:\.[^\s.<>]+)*\s([^<>]+)>")
_VOICE_MARK = re.compile(r"^\s*\x02([^\x03]*)\x03")


@dataclass(frozen=True, slots=True)
class SpokenText:
    """Text of a cue: as it is spoken, on one line, the text as shown, and its parts by speaker.

    The speaker of a part is a label or WebVTT voice, or empty for a dash without a name. `left_out` has the kind and
    text of each passage that is not spoken.
    """

    spoken: str
    shown: str
    parts: tuple[CuePart, ...]
    left_out: tuple[tuple[str, str], ...] = ()

    @property
    def speaker(self) -> str:
        """The first speaker that has a name; else empty."""
        return next((part.speaker for part in self.parts if part.speaker), "")


def spoken_text(
    written: str,
    markup: Markup = SUBRIP_MARKUP,
    *,
    keep: Collection[str] = (),
    speakers: Collection[str] | None = None,
    is_document: bool = False,
    rules: Rules | None = None,
) -> SpokenText:
    """Divide the text of a cue into words, tags, noises, lyrics and speakers.

    A label is a name before a colon and a space (``JOHN:``), at the start of a line. A part begins at a label, at a tag
    of one of several WebVTT voices, and at each of two or more dashes that begin a line or follow a sentence in it; a
    line after a sentence needs only a dash of its own. A cue that is an SSML document keeps its tags and is one part.

    Parameters
    ----------
    keep
        Kinds of what is not said, annotations and lyrics, that are spoken nevertheless.
    speakers
        Keys of the labels of the file; None: names in capitals.
    is_document
        The text is SSML, also without ``<speak>`` around it.
    rules
        By which brackets are marks, which stay in the text, rather than annotations; None: none are.
    """
    if markup.has_tags and (is_document or is_ssml(written)):
        document = " ".join(written.split())
        return SpokenText(document, " ".join(plain_text(written, markup).split()), (CuePart("", document),), ())
    is_dialogue = markup.has_tags and len({name.strip() for name in _VOICE.findall(written)}) > 1
    plain = plain_text(_VOICE.sub("\n\x02\\1\x03", written) if is_dialogue else written, markup)
    turns = divided_at_labels(plain, speakers) if speakers else plain
    said, left_out = _without_additions(without_manners(turns, speakers or ()), keep, rules)
    lines = spoken_lines(said)
    if any(map(_DASH.match, lines)):  # between people, also the dash before a number is one
        lines = [_DASHED_NUMBER.sub(r"\1 ", line) for line in lines]
    has_dashes = _is_dialogue(lines)
    parts: list[tuple[str, list[str]]] = [("", [])]
    for line in lines:
        speaker, rest = _speaker_of(line, speakers, has_dashes=has_dashes)
        if speaker is not None and not (speaker and speaker == parts[-1][0]):
            parts.append((speaker, []))
        parts[-1][1].append(rest)
    spoken = [CuePart(speaker, " ".join(" ".join(words).split())) for speaker, words in parts]
    spoken = [part for part in spoken if has_words(part.text)]
    shown = " ".join(re.sub(r"\x02[^\x02\x03]*\x03", "", plain).split())
    return SpokenText(" ".join(part.text for part in spoken), shown, tuple(spoken), left_out)


def _without_additions(
    text: str, keep: Collection[str], rules: Rules | None
) -> tuple[str, tuple[tuple[str, str], ...]]:
    """A text without noises and lyrics, and these with their kinds; kinds that are kept lose only their brackets."""
    found: list[tuple[str, str]] = []
    for kind, passage, brackets in ((ANNOTATIONS, _ANNOTATION, _BRACKETS), (LYRICS, _LYRICS, _NOTES)):
        marks: tuple[tuple[int, int], ...] = ()
        if kind == ANNOTATIONS and rules is not None:
            marks = _mark_spans(text, rules, has_directions=kind not in keep)
        parts, at = list[str](), 0
        for match in passage.finditer(text):
            if any(match.start() == start or (start < match.start() and match.end() <= end) for start, end in marks):
                continue
            parts += [text[at : match.start()], brackets.sub(" ", match[0]) if kind in keep else " "]
            at = match.end()
            if kind not in keep and any(map(str.isalnum, match[0])):
                found.append((kind, match[0]))
        text = "".join([*parts, text[at:]])
    return text, tuple(found)


def _mark_spans(text: str, rules: Rules, *, has_directions: bool) -> tuple[tuple[int, int], ...]:
    """Where a text has marks, also those that are not understood, and directions that show something."""
    if not _BRACKETS.search(text):
        return ()
    parts = read_parts(text.replace("\n", " "), rules)
    return tuple(
        (part.start, part.end)
        for part in parts
        if isinstance(part, Own)
        or (isinstance(part, Silent) and part.note)  # [style:sad without its end
        or (has_directions and isinstance(part, Cue) and (part.ends_style or _shows(part)))
    )


def _shows(cue: Cue) -> bool:
    return any(mark.style or mark.gesture or mark.pause_s for mark in cue.marks)


def spoken_lines(text: str) -> list[str]:
    """Lines of a text without tags, divided also where another person begins within one."""
    return [part for line in text.split("\n") for part in _at_dashes(line)]


def _at_dashes(line: str) -> list[str]:
    """A line divided before the dashes that follow a whole sentence: another person begins one there.

    In a line without a dash at its start a long dash may be a pause, and one after a quotation belongs to its frame.
    """
    has_first = _DASH.match(line) is not None
    starts = [0]
    for match in _INNER_DASH.finditer(line):
        is_turn = match["dash"].startswith(">>") or (
            _ENDS_SENTENCE.search(line[max(match.start() - _END_CHARACTERS, 0) : match.start()]) is not None
            and not match["letter"].islower()
            and not line[match.end("dash") :][:1].isdigit()  # -5 is a number
            and (has_first or (match["dash"] in "-–" and match["letter"].isalpha()))
        )
        starts += [match.end()] if is_turn else []
    return [line[start:end] for start, end in zip(starts, [*starts[1:], None], strict=True)]


def _is_dialogue(lines: Sequence[str]) -> bool:
    """Whether dashes stand for speakers: there are two, or one after a line with a whole sentence of somebody else."""
    dashed = [_DASH.match(line) is not None for line in lines]
    follows = (
        is_next and _ENDS_SENTENCE.search(line[-_END_CHARACTERS:])
        for line, is_next in zip(lines, dashed[1:], strict=False)
    )
    return sum(dashed) > 1 or any(follows)


def _speaker_of(line: str, speakers: Collection[str] | None, *, has_dashes: bool) -> tuple[str | None, str]:
    """Speaker who begins at a line, empty if unnamed and None if the line continues, and the words of the line."""
    voice = _VOICE_MARK.match(line)
    if voice:
        return " ".join(voice[1].split()), _DASH.sub("", line[voice.end() :])
    label = split_label(line, speakers)
    if label is not None:
        return label
    dash = _DASH.match(line)
    if dash:
        return ("" if has_dashes else None), line[dash.end() :]
    return None, line
