"""Parsing and checking of a request's text, marks and timeline file."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from fractions import Fraction
from typing import Any

from lexicon.dictionary import read_dictionary
from lexicon.errors import InputError
from lexicon.inputs import is_file
from lexicon.ipa import Segment
from lexicon.mark_parser import parse_marks
from lexicon.marked_text import MarkedText
from lexicon.sentences import Sentence, split_sentences
from lexicon.writing_systems import check_readable
from tts2face.clock import exact_rate
from tts2face.exemplar.options import METHOD_OPTIONS, ExcludedToken, SynthesisOptions
from tts2face.gesture.elements import Gains
from tts2face.gesture.notation import parse_expressions, parse_gains, parse_style
from tts2face.gesture.timeline import Timeline
from tts2face.gesture.timeline_file import read_timeline
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.storage.overwrite import AnyPath
from tts2face.synthesis.mark_styles import check_marks
from tts2face.synthesis.phone_edges import SentenceEdges

RECORDING_STEPS = 1000  # steps of progress of a recording
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
    """

    request: Request
    text: MarkedText
    timeline: Timeline
    options: SynthesisOptions
    dictionary: Mapping[str, tuple[Segment, ...]] = field(default_factory=dict)
    edges: tuple[SentenceEdges, ...] = ()
    excluded: tuple[ExcludedToken, ...] = ()

    @property
    def fps(self) -> Fraction:
        """Frames per second."""
        return exact_rate(self.request.fps)

    @property
    def n_steps(self) -> int:
        """Total steps of progress: characters of a text, or parts of a recording or of idle animation."""
        if self.request.audio is not None:
            return RECORDING_STEPS
        return IDLE_STEPS if self.request.idle is not None else max(len(self.text.text), 1)

    def sentences(self) -> Iterator[Sentence]:
        """Sentences of the text in order."""
        return split_sentences(self.text, self.request.language, self.dictionary)


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
    if request.audio is not None and not is_file(request.audio):
        raise InputError(f"there is no recording {request.audio}; check the path")
    prepared = PreparedRequest(
        request,
        parse_marks(request.text, request.language),
        build_request_timeline(request),
        synthesis_options(request),
        read_dictionary(request.dictionary).entries if request.dictionary else {},
    )
    if not request.text.strip() and (request.audio is not None or request.idle is not None):
        return prepared
    check_readable(prepared.text, request.language)
    check_marks(prepared.text, request)
    if next(prepared.sentences(), None) is None:
        raise InputError(f"there is nothing to say in {request.text[:40]!r}; give at least one word")
    return prepared


def prepare_request(text: str | Request | PreparedRequest, options: dict[str, Any]) -> PreparedRequest:
    """Prepare a text with options by name, or a complete request, once.

    Raises
    ------
    InputError
        An option does not exist, or options are given together with a complete request; errors as `prepare`.
    """
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
    """A picture, from its fields among the options if it is None, and the options of the request.

    Raises
    ------
    InputError
        A field of the picture is invalid.
    """
    if picture is not None:
        return picture, options
    names = _option_names(Picture)
    chosen = {name: value for name, value in options.items() if name in names}
    return Picture(**chosen), {name: value for name, value in options.items() if name not in names}


def _option_names(kind: type) -> tuple[str, ...]:
    return tuple(option.name for option in fields(kind) if option.name != "text")


def build_request_timeline(request: Request) -> Timeline:
    """Timeline of a request's ``timeline`` file, overridden by its ``style``, ``gain`` and ``expression``.

    Raises
    ------
    InputError, DataError
        An option cannot be parsed, or the file is invalid.
    """
    flags = Timeline(
        style=parse_style(request.style) if request.style is not None else {},
        expressions=parse_expressions(request.expression) if request.expression is not None else (),
        gains=parse_gains(request.gain) if request.gain is not None else Gains(),
    )
    return read_timeline(request.timeline).merge(flags) if request.timeline is not None else flags


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
    return {
        "audio": request.audio,
        "dictionary": request.dictionary,
        "timeline": request.timeline,
        "voice": request.voice,
        "voice settings": f"{request.voice}.json" if request.voice else None,
        "background": picture.background,
    }
