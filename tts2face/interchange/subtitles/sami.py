"""SAMI (``.smi``): text after ``<SYNC Start=1000>`` in milliseconds, in one class for each language."""

import html
import re

from lexicon.errors import InputError
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import PLAIN_MARKUP

_SYNC = re.compile(r"<SYNC\b[^<>]*?\bStart\s*=\s*[\"']?(-?\d{1,12})[^<>]*>", re.IGNORECASE)
_PARAGRAPH = re.compile(r"<P\b(?P<attributes>[^<>]*)>", re.IGNORECASE)
_CLASS = re.compile(r"\bClass\s*=\s*[\"']?([\w-]+)", re.IGNORECASE)
_STYLE = re.compile(r"\.([\w-]+)\s*\{([^}]*)\}")
_LANGUAGE = re.compile(r"\blang\s*:\s*[\"']?([A-Za-z]{2,3}(?:-[A-Za-z0-9]+)*)", re.IGNORECASE)
_BREAK = re.compile(r"<br\b[^<>]*>", re.IGNORECASE)
_TAG = re.compile(r"</?[A-Za-z][^<>]*>")
_COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
_END = re.compile(r"</BODY>|</SAMI>", re.IGNORECASE)


def read_sami(text: str, language: str | None, track: str | None) -> tuple[list[WrittenCue], list[SubtitleWarning]]:
    """Cues of one class: the one that is named, of a language, or the first one."""
    languages = {name.casefold(): found[1] for name, body in _STYLE.findall(text) if (found := _LANGUAGE.search(body))}
    classes: dict[str, list[WrittenCue]] = {}
    names: dict[str, str] = {}
    body = _COMMENT.sub(lambda match: "\n" * match[0].count("\n"), text)
    syncs = list(_SYNC.finditer(body))
    line, at = 1, 0
    for number, sync in enumerate(syncs):
        line, at = line + body.count("\n", at, sync.start()), sync.start()
        end = syncs[number + 1].start() if number + 1 < len(syncs) else len(body)
        for name, words in _paragraphs(body[sync.end() : end]):
            names.setdefault(name.casefold(), name)
            cues = classes.setdefault(name.casefold(), [])
            start = int(sync[1]) / 1000.0
            if cues and cues[-1].end_s is None:
                last = cues.pop()
                cues.append(
                    WrittenCue(last.begin_s, start, last.text, last.line, language=last.language, markup=PLAIN_MARKUP)
                )
            cues.append(
                WrittenCue(start, None, words, line, language=languages.get(name.casefold()), markup=PLAIN_MARKUP)
            )
    worded = {key: [cue for cue in cues if cue.text] for key, cues in classes.items()}
    worded = {key: cues for key, cues in worded.items() if cues}
    if not worded:
        return [], []
    chosen = _choose(worded, languages, language, track)
    if len(worded) == 1:
        return worded[chosen], []
    shown = ", ".join(
        f"{names[key] or '(no class)'} ({languages.get(key, 'no language')}, {len(cues)} cues)"
        for key, cues in worded.items()
    )
    message = f"the file has the classes {shown}; {names[chosen] or '(no class)'} is read, --track names another one"
    return worded[chosen], [SubtitleWarning(1, message)]


def _paragraphs(written: str) -> list[tuple[str, str]]:
    """Class and text of the paragraphs of an instant."""
    body = _END.split(written)[0]
    marks = list(_PARAGRAPH.finditer(body))
    if not marks:
        return [("", _text(body))]
    ends = [mark.start() for mark in marks[1:]] + [len(body)]
    return [
        (found[1] if (found := _CLASS.search(mark["attributes"])) else "", _text(body[mark.end() : end]))
        for mark, end in zip(marks, ends, strict=True)
    ]


def _text(written: str) -> str:
    lines = _BREAK.sub("\x00", " ".join(written.split())).split("\x00")
    plain = [html.unescape(_TAG.sub("", line)).replace("\u00a0", " ").strip() for line in lines]
    return "\n".join(line for line in plain if line)


def _choose(
    classes: dict[str, list[WrittenCue]], languages: dict[str, str], language: str | None, track: str | None
) -> str:
    if track is not None:
        for key in classes:
            if key == track.casefold() or languages.get(key, "").casefold().split("-")[0] == track.casefold():
                return key
        raise InputError(f"there is no class {track!r}; the file has {', '.join(classes)}")
    wanted = (language or "").casefold().split("-")[0]
    return next(
        (key for key in classes if wanted and languages.get(key, "").casefold().split("-")[0] == wanted),
        next(iter(classes)),
    )
