"""Text that subtitles show and nobody says: signs, effects, annotations, lyrics, credits, and what is shown again."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from types import MappingProxyType

from lexicon.dictionary import word_set
from tts2face.interchange.subtitles.cues import SubtitleWarning, WrittenCue
from tts2face.interchange.subtitles.markup import PLAIN_MARKUP, plain_text

ANNOTATIONS = "annotations"
LYRICS = "lyrics"
SIGNS = "signs"
EFFECTS = "effects"
CREDITS = "credits"
REPEATS = "repeats"
KINDS = MappingProxyType({
    ANNOTATIONS: "noises and manners in brackets, such as [door slams]",
    LYRICS: "sung lines between notes, or in styles of songs",
    SIGNS: "writing in the picture: styles such as Sign or Title, and placed text",
    EFFECTS: "frames and syllables of karaoke and other effects",
    CREDITS: "who made the subtitles",
    REPEATS: "what a cue shows again of the cue before it, copies in layers or regions, and a second language",
})  # fmt: skip
MAX_SHOWN = 40  # characters of an example in a note
FIRST_CUES, LAST_CUES = 3, 4  # of a file, among which credits stand
MAX_CREDIT_WORDS = 12
# Words of the names of styles, in small letters.
_SIGN_STYLES = word_set("sign signs title titles typeset typesetting ts credit credits eptitle note notes")
_LYRIC_STYLES = word_set("op ed opening ending song songs karaoke kara lyric lyrics romaji kanji insert theme")
_STYLE_WORD = re.compile(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])")
_MAKER = (
    r"(?:sub(?:title)?s?|subtitled|subtitling|(?:closed )?caption(?:s|ed|ing)?|sync(?:ed|s|hroni[sz]ed|hroni[sz]ation)?"
    r"|correct(?:ed|ions?)|translat(?:ed|ion)|transcri(?:bed|pts?|ption)|ripped|encoded|resync(?:ed)?|timed|timing"
    r"|edited|downloaded|uploaded|created|fixed|improved)"
)
_AND = r"(?:\s*(?:,|&|and|\+|/)\s*|\s+)"
# "Fixed: the bug" is said; a bare colon names makers only after work on subtitles
_SUBTITLER = r"(?:sub(?:title)?s?|subtitl(?:ed|ing)|(?:closed )?caption\w*|(?:re)?sync\w*|translat(?:ed|ion))"
_MADE_BY = re.compile(
    rf"{_MAKER}(?:{_AND}{_MAKER})*\s*(?:\bby\b|\bfrom\b)\s*\S"
    rf"|(?:{_MAKER}{_AND})*{_SUBTITLER}(?:{_AND}{_MAKER})*\s*:\s*\S"
    r"|(?:untertitel(?:ung)?|deutsche untertitel|sous-titres?|sous-titrage|traduction|subt[ií]tulos|traducci[oó]n"
    r"|legendas|tradu[cç][aã]o|sottotitoli|traduzione|napisy|t[lł]umaczenie|titulky|p[rř]eklad|felirat(?:ok)?"
    r"|ford[ií]totta|titlovi|prijevod|prevod|podnapisi|ondertiteling|undertexter|tekster|tekstitys|субтитры|перевод"
    r"|altyaz[ıi]|çeviri|υπότιτλοι|字幕|翻译|翻譯)"
    r"(?:\s*(?:von|im auftrag|par|por|de|di|du|a cura di|przez|od|av|af|door|:|：)\s*\S|：?\S{1,12}$)",
    re.IGNORECASE,
)
_ADDRESS = re.compile(r"(?:https?://|www\.)\S+|\b[\w-]+\.(?:com|org|net|tv|info)\b", re.IGNORECASE)
_ADVERTISEMENT = re.compile(
    r"subtitl|addic7ed|subscene|\b(?:captions?|captioned|yts|vip member|advertise your|sync(?:ed)?|rip(?:ped|s)?)\b",
    re.IGNORECASE,
)


def kind_of_style(style: str) -> str:
    """Kind of the text of a style of SubStation Alpha, by the words of its name; empty for dialogue."""
    words = {word.lower() for word in _STYLE_WORD.findall(style)}
    if words & _SIGN_STYLES:
        return SIGNS
    return LYRICS if words & _LYRIC_STYLES else ""


def is_credit(text: str) -> bool:
    """Whether a text on one line says who made the subtitles, or advertises their source."""
    words = text.split()
    if not words or len(words) > MAX_CREDIT_WORDS:
        return False
    if _ADDRESS.search(text) and _ADVERTISEMENT.search(text):
        return True
    made = _MADE_BY.match(text.lstrip("-–—*~=<>[(♪ "))
    # "Translated by hand, the book took years." is a sentence of somebody.
    return made is not None and not text.rstrip(" ])").endswith((".", "!", "?", "…"))


def with_credits(cues: Sequence[WrittenCue]) -> list[WrittenCue]:
    """Cues, of which the first and last ones that are credits have that kind."""
    return [
        replace(cue, kind=CREDITS)
        if not cue.kind
        and (number < FIRST_CUES or number >= len(cues) - LAST_CUES or _ADDRESS.search(cue.text))
        and is_credit(" ".join(plain_text(cue.text, cue.markup).split()))
        else cue
        for number, cue in enumerate(cues)
    ]


def notes_of(found: Iterable[tuple[str, int, str]]) -> list[SubtitleWarning]:
    """A note for each kind of what is not spoken: how many, and an example.

    Parameters
    ----------
    found
        Kind, line and text of each.
    """
    kinds: dict[str, list[tuple[int, str]]] = {}
    for kind, line, text in found:
        kinds.setdefault(kind, []).append((line, " ".join(text.split())))
    notes = []
    for kind, places in kinds.items():
        example = next((text for _, text in places if text), "")[:MAX_SHOWN]
        shown = f", such as {example!r}," if example else ""
        name = kind if len(places) != 1 else kind.removesuffix("s")
        verb = "are" if len(places) != 1 else "is"
        notes.append(
            SubtitleWarning(
                places[0][0], f"{len(places)} {name}{shown} {verb} not spoken; --keep {kind} speaks {_them(places)}"
            )
        )
    return notes


def _them(places: Sequence[object]) -> str:
    return "them" if len(places) != 1 else "it"


def as_text(cue: WrittenCue, text: str) -> WrittenCue:
    """A cue with another text without markup."""
    return replace(cue, text=text, markup=PLAIN_MARKUP)
