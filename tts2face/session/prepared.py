"""A request that is parsed and checked once: its text with its marks, its timeline and its options of synthesis."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lexicon.dictionary import read_dictionary
from lexicon.errors import InputError
from lexicon.foreign_words import make_readable
from lexicon.ipa import IpaPhone
from lexicon.marked_text import MarkedText
from lexicon.scripts import check_readable
from lexicon.sentences import Sentence, split_sentences
from lexicon.text_marks import parse_marks
from lexicon.values.files import is_file
from tts2face.gestures.timeline import Timeline
from tts2face.lips.options import METHOD_OPTIONS, ExcludedToken, SynthesisOptions
from tts2face.picture.options import Picture
from tts2face.request import Request, option_fields
from tts2face.session.corrections import SentenceEdges
from tts2face.session.joining import Excerpt
from tts2face.session.request_timeline import build_request_timeline, listening_timeline
from tts2face.session.text_marks import check_marks
from tts2face.source import Listening, Recorded, Source, Spoken
from tts2face.storage.output_paths import AnyPath
from tts2face.types import exact_rate

if TYPE_CHECKING:
    from tts2face.sound.voice_pool import VoicePool

HEARING_STEPS, RECORDING_STEPS = 300, 700  # steps of progress of a recording: until its phones are known, and then
IDLE_STEPS = 1000  # steps of progress of idle animation


@dataclass(frozen=True, slots=True, eq=False)
class PreparedRequest:
    """A request with its parsed text, timeline and synthesis options, as `prepare` returns it.

    Parameters
    ----------
    text
        Text and marks; empty for a recording without words and for idle animation.
    timeline
        Gestures requested by the flags and the timeline file.
    options
        Options of lip synthesis from exemplars.
    dictionary
        The user's pronunciations by `lexicon.dictionary.word_key`.
    edges
        Corrected phone edges of sentences.
    excluded
        Recorded tokens that are not used.
    listening
        What the face does while it listens, in seconds from the beginning of ``listen``.
    excerpt
        What of the speech is kept; None: all.
    notes
        What is spoken in another way than a reader may expect, each a sentence without its stop.
    """

    request: Request
    text: MarkedText
    timeline: Timeline
    options: SynthesisOptions
    dictionary: Mapping[str, tuple[IpaPhone, ...]] = field(default_factory=dict)
    edges: tuple[SentenceEdges, ...] = ()
    excluded: tuple[ExcludedToken, ...] = ()
    listening: Timeline = field(default_factory=Timeline)
    excerpt: Excerpt | None = None
    notes: tuple[str, ...] = ()

    @property
    def fps(self) -> Fraction:
        """Frames per second."""
        return exact_rate(self.request.fps)

    @property
    def n_steps(self) -> int:
        """Total steps of progress: characters of a text, or parts of a recording or of idle animation."""
        match self.request.source:
            case Recorded():
                return HEARING_STEPS + RECORDING_STEPS
            case Spoken():
                return max(len(self.text.text), 1)
            case _:
                return IDLE_STEPS + len(self.text.text)

    def sentences(self) -> Iterator[Sentence]:
        """Sentences of the text in order."""
        return split_sentences(self.text, self.request.language, self.dictionary)

    def preload_voice(self, voices: "VoicePool") -> None:
        """Load the voice of the text in a thread; none for a recording or a request without text."""
        spoken = self.request.spoken
        if spoken is not None and spoken.text:
            voices.preload(spoken.voice, self.request.language, self.dictionary)


def prepare(request: Request) -> PreparedRequest:
    """Parse and check the text, marks and timeline of a request, in time linear in the length of the text.

    Raises
    ------
    InputError
        The text has no word or characters that the language does not read, a mark or a gesture option is invalid, or
        the recording does not exist.
    DataError
        The timeline file or the dictionary is invalid.
    """
    source = request.source
    for path in recordings(source).values():
        if not is_file(path):
            raise InputError(f"there is no recording {path}; check the path")
    written = parse_marks(source.text, request.language)
    text, notes = make_readable(written, request.language)
    prepared = PreparedRequest(
        request,
        text,
        build_request_timeline(request),
        synthesis_options(request),
        read_dictionary(request.dictionary).entries if request.dictionary else {},
        listening=listening_timeline(request),
        notes=notes,
    )
    if not source.text and not isinstance(source, Spoken):
        return prepared
    check_readable(text, request.language)
    check_marks(written, request)
    if next(prepared.sentences(), None) is None:
        raise InputError(f"there is nothing to say in {source.text[:40]!r}; give at least one word")
    return prepared


def recordings(source: Source) -> dict[str, Path]:
    """Paths of the sounds that a source reads, by the names of their options."""
    match source:
        case Recorded():
            return {"audio": source.audio}
        case Listening() if source.partner is not None:
            return {"partner": source.partner}
        case _:
            return {}


def prepare_request(text: str | Request | PreparedRequest, options: dict[str, Any]) -> PreparedRequest:
    """Prepare a text with options by name, or a complete request, once."""
    known = _option_names(Request)
    for name in options:
        if name not in known:
            raise InputError(f"there is no option {name!r}; the options are {', '.join(known)}")
    if isinstance(text, str):
        return prepare(Request(text=text, **options))
    if options:
        raise InputError(
            f"the option {next(iter(options))!r} cannot be given with a complete request; set it in the request"
        )
    return prepare(text) if isinstance(text, Request) else text


def split_picture(picture: Picture | None, options: dict[str, Any]) -> tuple[Picture, dict[str, Any]]:
    """A picture, from its fields among the options if it is None, and the options of the request."""
    if picture is not None:
        return picture, options
    names = _option_names(Picture)
    chosen = {name: value for name, value in options.items() if name in names}
    return Picture(**chosen), {name: value for name, value in options.items() if name not in names}


def _option_names(kind: type) -> tuple[str, ...]:
    return tuple(option.name for option in option_fields(kind) if option.name != "text")


def synthesis_options(request: Request) -> SynthesisOptions:
    """Synthesis options of the request's method, with the request's own context, exemplars and articulation."""
    options = METHOD_OPTIONS[request.synthesis]
    if request.context is not None:
        options = replace(options, context=request.context)
    if request.exemplars is not None:
        options = replace(options, k=request.exemplars)
    return replace(options, articulation=request.articulation_factor)


def input_paths(request: Request, picture: Picture) -> dict[str, AnyPath]:
    """Paths of the files that a request and a picture read, by the names of their options."""
    voice = None if request.spoken is None else request.spoken.voice
    return {
        **recordings(request.source),
        "dictionary": request.dictionary,
        "timeline": request.timeline,
        "voice": voice,
        "voice settings": f"{voice}.json" if voice else None,
        "background": picture.background,
    }
