"""A request with its text, marks and timeline file read and checked, once."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from fractions import Fraction

from lexicon.errors import InputError
from lexicon.mark_parser import parse_marks
from lexicon.marked_text import MarkedText
from lexicon.sentences import Sentence, split_sentences
from lexicon.writing_systems import check_readable
from tts2face.clock import exact_rate
from tts2face.exemplar.options import METHOD_OPTIONS, SynthesisOptions
from tts2face.gesture.request_timeline import build_request_timeline
from tts2face.gesture.timeline import Timeline
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.storage.overwrite import AnyPath
from tts2face.synthesis.marked_speech import check_marks

RECORDING_STEPS = 1000  # of progress through a recording
IDLE_STEPS = 1000  # through a silent clip


@dataclass(frozen=True, slots=True, eq=False)
class PreparedRequest:
    """A request that can be fulfilled as far as its text and options tell; `prepare` makes it.

    Parameters
    ----------
    text
        The text without its marks, and the marks; empty for a recording without words and for an idle face.
    timeline
        What the request's flags and timeline file ask of the gestures.
    options
        How lips are made from recorded examples.
    """

    request: Request
    text: MarkedText
    timeline: Timeline
    options: SynthesisOptions

    @property
    def fps(self) -> Fraction:
        """Frames per second."""
        return exact_rate(self.request.fps)

    @property
    def n_steps(self) -> int:
        """Steps of progress: characters of a text, or parts of a recording or of an idle clip."""
        if self.request.audio is not None:
            return RECORDING_STEPS
        return IDLE_STEPS if self.request.idle is not None else max(len(self.text.text), 1)

    def sentences(self) -> Iterator[Sentence]:
        """The sentences that a voice speaks one by one."""
        return split_sentences(self.text, self.request.language)


def prepare(request: Request) -> PreparedRequest:
    """Read what a request gives as text and refuse what cannot be spoken or shown; cheap at any length.

    Raises
    ------
    InputError
        There is no word in the text, the language does not exist or cannot read it, a mark in it is wrong, there is no
        such recording, or an option of the gestures cannot be read.
    DataError
        The timeline file is wrong.
    """
    if request.audio is not None and not request.audio.is_file():
        raise InputError(f"there is no recording {request.audio}; check the path")
    prepared = PreparedRequest(
        request,
        parse_marks(request.text, request.language),
        build_request_timeline(request),
        synthesis_options(request),
    )
    if not request.text.strip() and (request.audio is not None or request.idle is not None):
        return prepared
    check_readable(prepared.text, request.language)
    check_marks(prepared.text, request)
    if next(prepared.sentences(), None) is None:
        raise InputError(f"there is nothing to say in {request.text[:40]!r}; give at least one word")
    return prepared


def synthesis_options(request: Request) -> SynthesisOptions:
    """How lips are made from recorded examples: the method's options, with those that the request changes."""
    options = METHOD_OPTIONS[request.synthesis]
    if request.context is not None:
        options = replace(options, context=request.context)
    if request.exemplars is not None:
        options = replace(options, k=request.exemplars)
    return options


def input_paths(request: Request, picture: Picture) -> dict[str, AnyPath]:
    """Files that a request and a picture read, by the name of their option."""
    return {
        "audio": request.audio,
        "dictionary": request.dictionary,
        "timeline": request.timeline,
        "voice": request.voice,
        "voice settings": f"{request.voice}.json" if request.voice else None,
        "background": picture.background,
    }
