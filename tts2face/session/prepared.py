"""A request that is parsed and checked once: its text and marks, its timelines and its options of synthesis."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lexicon.dictionary import read_dictionary
from lexicon.errors import InputError
from lexicon.foreign_words import make_readable
from lexicon.gesture_names import GESTURES
from lexicon.ipa import IpaPhone
from lexicon.languages import language_code
from lexicon.mark_table import read_marks_table
from lexicon.marked_text import PITCH_LIMITS, RANGE_LIMITS, RATE_LIMITS, VOLUME_LIMITS, GestureMark, MarkedText
from lexicon.scripts import check_readable
from lexicon.sentence_length import check_silence, marked_silence_s
from lexicon.sentences import MAX_LAST_GESTURE_S, Sentence, split_sentences
from lexicon.sequence import PhoneSequence
from lexicon.spoken_mark import with_spoken_mark
from lexicon.ssml_prosody import semitones_factor
from lexicon.text_marks import is_ssml, parse_marks
from lexicon.values.checks import check_limits
from lexicon.values.files import is_file
from tts2face.gestures.elements import Gesture
from tts2face.gestures.timeline import Timeline
from tts2face.lips.options import METHOD_OPTIONS, ExcludedToken, SynthesisOptions
from tts2face.models.palette_file import load_palette
from tts2face.models.person import Person
from tts2face.picture.options import Picture
from tts2face.request import Idle, Listening, Recorded, Request, Source, Spoken, option_fields
from tts2face.session.corrections import SentenceEdges, StaleEdgesError
from tts2face.session.joining import Excerpt
from tts2face.session.marked_styles import marked_styles, with_styles_of
from tts2face.session.request_timeline import build_request_timeline, listening_timeline
from tts2face.sound.fitting import Fitting, fitting_voice
from tts2face.sound.voice_pool import usual_pitch_hz
from tts2face.sound.voice_urls import is_voice_url
from tts2face.source_options import IDLE_LIMITS_S, is_auto
from tts2face.storage.marks import Making
from tts2face.storage.output_paths import AnyPath
from tts2face.types import exact_rate

if TYPE_CHECKING:
    from tts2face.sound.voice_pool import VoicePool

HEARING_STEPS, RECORDING_STEPS = 300, 700  # steps of progress of a recording: until its phones are known, and then
IDLE_STEPS = 1000  # steps of progress of idle animation
_NOTED = re.compile(r"[\[<]")  # characters of marks that may get notes
SILENT_S = 0.5  # of a text without words, as of the pause behind a sentence


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
    notes_on_sound
        What is guessed about the recordings.
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
    notes_on_sound: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """Sentences without their stops on words that are spoken or shown otherwise than a reader may expect."""
        return (*self.text.notes, *self.notes_on_sound)

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

    def corrected(self, phones: PhoneSequence, text: str, occurrence: int) -> PhoneSequence:
        """Phones of a sentence at their corrected edges, or as they are without a correction."""
        for correction in self.edges:
            if (correction.text, correction.occurrence) == (text, occurrence):
                corrected = correction.applied(phones)
                if corrected is None:
                    raise StaleEdgesError(text, occurrence)
                return corrected
        return phones

    def fitting(self, person: Person | None) -> Fitting | None:
        """Voice in which a person speaks the text; None for a recording and a request without text."""
        spoken = self.request.spoken
        if spoken is None or not spoken.text:
            return None
        return Fitting(spoken.voice) if spoken.voice else fitting_voice(person, self.request.language)

    def making(self, person: Person | None) -> Making:
        """Text that is spoken and the name of its voice, for the marks of files."""
        fitting = self.fitting(person)
        if fitting is None:
            return Making(self.text.text)
        # a path would tell where it lies, an address which server is used
        name = fitting.name.rpartition("#")[2] if is_voice_url(fitting.name) else Path(fitting.name).stem
        return Making(self.text.text, name)

    def preload_voice(self, voices: "VoicePool", person: Person | None = None) -> None:
        """Load the voice of the text in a thread; none for a recording or a request without text."""
        if (fitting := self.fitting(person)) is not None:
            voices.preload(fitting.name, self.request.language, self.dictionary)

    def with_seed(self, seed: int) -> "PreparedRequest":
        """The same with the seed of a face, where the request has none."""
        if self.request.seed is not None:
            return self
        request = replace(self.request, seed=seed)
        has_partner = isinstance(request.source, Listening) and request.source.partner is not None
        return replace(self, request=request, listening=listening_timeline(request) if has_partner else self.listening)


def prepare(request: Request, person: Person | None = None) -> PreparedRequest:
    """Parse and check the text, marks and timeline of a request, in time linear in the length of the text.

    Parameters
    ----------
    person
        Who is shown, in whose voice a text is spoken that names none.

    Raises
    ------
    InputError
        There is no text, it has characters that the language does not read, a gesture option is invalid, or the
        recording does not exist.
    DataError
        The timeline file, the dictionary or the table of marks is invalid.
    """
    source = request.source
    for path in recordings(source).values():
        if not is_file(path):
            raise InputError(f"there is no recording {path}; check the path")
    written, text = read_text(request, person)
    request = replace(request, style=None) if is_auto(request.style) else request
    prepared = PreparedRequest(
        request,
        text,
        build_request_timeline(request),
        synthesis_options(request),
        read_dictionary(request.dictionary).entries if request.dictionary else {},
        listening=listening_timeline(request),
        notes_on_sound=_notes_on(source),
    )
    if not source.text and not isinstance(source, Spoken):
        return prepared
    check_readable(text, request.language)
    check_marks(written, request)
    if next(prepared.sentences(), None) is not None:
        return prepared
    if isinstance(source, Recorded) or not source.text.strip():
        raise InputError(f"there is nothing to say in {source.text[:40]!r}; give at least one word")
    return _silent(prepared)


def _silent(prepared: PreparedRequest) -> PreparedRequest:
    """A request whose text has no word, as silence with the gestures and the pauses of its marks."""
    request, source = prepared.request, prepared.request.source
    gestures = tuple(mark for mark in prepared.text.marks if isinstance(mark, GestureMark))
    moving_s = max((mark.seconds or GESTURES[mark.name].seconds for mark in gestures), default=0.0)
    seconds = max(SILENT_S, min(moving_s, MAX_LAST_GESTURE_S), marked_silence_s(prepared.text))
    timeline = Timeline(gestures=tuple(gesture_of(mark, 0.0) for mark in gestures))
    silent = replace(source, then=None) if isinstance(source, Listening) else Idle(min(seconds, IDLE_LIMITS_S[1]))
    return replace(
        prepared, request=replace(request, source=silent),
        text=MarkedText("", marks=gestures, notes=prepared.text.notes), listening=prepared.listening.merge(timeline),
    )  # fmt: skip


def gesture_of(mark: GestureMark, time: float) -> Gesture:
    """The gesture of a mark, at a second."""
    return Gesture(time, mark.name, mark.size, mark.seconds, mark.down_deg, mark.left_deg)


def read_text(request: Request, person: Person | None = None) -> tuple[MarkedText, MarkedText]:
    """Text of a request with its marks, as it is written, and as it is spoken with the moods of the style auto.

    The notes of the second one are those on the whole. Raises as `parse_marks`.
    """
    written = with_styles_of(read_marks(request, person), None)
    text, notes = make_readable(written, request.language)
    if is_auto(request.style):
        from lexicon.moods import with_moods

        text, moods = with_moods(text, request.language)
        notes = (*notes, *moods)
    return written, replace(text, notes=(*written.notes, *notes))


def reading_notes(request: Request, palette: str | Path | None) -> tuple[str, ...]:
    """Notes on the text of a request, with those on styles that a palette lacks; without preparing the request.

    Raises
    ------
    InputError, DataError
        As `read_text` and `load_palette`.
    """
    text, is_ssml_of_auto = request.source.text, request.markup == "ssml" or is_ssml(request.source.text)
    if text.isascii() and not is_ssml_of_auto and not _NOTED.search(text) and not is_auto(request.style):
        return ()
    _, found = read_text(request)
    if palette is not None and request.has_gestures and marked_styles(found):
        found = with_styles_of(found, load_palette(str(palette)).names)
    return found.notes


def read_marks(request: Request, person: Person | None = None) -> MarkedText:
    """Text of a request with its marks, whose pitches in Hz are those of a person's voice; errors as `parse_marks`."""
    source, spoken = request.source, request.spoken

    def voice_hz(name: str | None, language: str) -> float:
        of_request = spoken or Spoken("")
        named, pitch = name or of_request.voice, of_request.voice_pitch
        if named is None:
            fitting = fitting_voice(person, language_code(language))
            named, pitch = fitting.name, pitch + fitting.prosody.pitch
        return usual_pitch_hz(named, language) * semitones_factor(pitch)

    language, has_emphasis = request.language, spoken is not None
    table = read_marks_table(request.text_marks)
    written = parse_marks(
        source.text, language, request.markup, has_emphasis=has_emphasis, voice_hz=voice_hz, table=table
    )
    notice = None if spoken is None or not source.text.strip() else spoken.spoken_mark
    return written if notice is None else with_spoken_mark(written, notice, language)


def recordings(source: Source) -> dict[str, Path]:
    """Paths of the sounds that a source reads, by the names of their options."""
    match source:
        case Recorded():
            return {"audio": source.audio}
        case Listening() if source.partner is not None:
            return {"partner": source.partner}
        case _:
            return {}


def _notes_on(source: Source) -> tuple[str, ...]:
    """Sentences on what is guessed about the recordings of a source."""
    found = recordings(source).values()
    if not found:
        return ()
    from tts2face.video.sound_survey import sound_notes

    return sound_notes(found)


def prepare_request(
    text: str | Request | PreparedRequest, options: dict[str, Any], person: Person | None = None
) -> PreparedRequest:
    """Prepare a text with options by name, or a complete request, once; `person` as for `prepare`."""
    known = _option_names(Request)
    for name in options:
        if name not in known:
            raise InputError(f"there is no option {name!r}; the options are {', '.join(known)}")
    if isinstance(text, str):
        return prepare(Request(text=text, **options), person)
    if options:
        raise InputError(
            f"the option {next(iter(options))!r} cannot be given with a complete request; set it in the request"
        )
    return prepare(text, person) if isinstance(text, Request) else text


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
    voice = None if request.spoken is None or is_voice_url(request.spoken.voice) else request.spoken.voice
    return {
        **recordings(request.source),
        "dictionary": request.dictionary,
        "text marks": request.text_marks,
        "timeline": request.timeline,
        "voice": voice,
        "voice settings": f"{voice}.json" if voice else None,
        "background": picture.background,
    }


def check_marks(text: MarkedText, request: Request) -> None:
    """Reject marks that are invalid or do not go with the request, in time linear in the length of the text."""
    if isinstance(request.source, Recorded) and text.has_voice_changes:
        raise InputError(
            "[pause], <break>, <prosody>, <emphasis>, <voice> and <lang> have no effect on a recording; remove them or "
            "--audio"
        )
    # en-GB in a request of en-us is one language, de is another
    if text.language is not None and _primary(language_code(text.language)) != _primary(request.language):
        raise InputError(f"the text names the language {text.language}, not {request.language}; choose one of them")
    check_silence(text)
    spoken = request.spoken or Spoken("")
    for what, marked, requested, (low, high) in (
        ("speed", {run.rate for run in text.runs}, spoken.rate, RATE_LIMITS),
        ("loudness", {run.volume for run in text.runs}, spoken.volume, VOLUME_LIMITS),
        ("range of pitch", {run.tone.range for run in text.runs}, spoken.voice_range, RANGE_LIMITS),
    ):
        for factor in marked:
            if not low <= factor * requested <= high:
                raise InputError(
                    f"a {what} of {factor:g} in the text times {requested:g} of the request lies outside "
                    f"{low:g} to {high:g}; change one of them"
                )
    for pitch in {run.tone.pitch for run in text.runs}:
        what = f"the pitch of the text ({pitch:.3g} semitones) and of the request together"
        check_limits(what, round(pitch + spoken.voice_pitch, 6), PITCH_LIMITS)


def _primary(language: str) -> str:
    """Primary language of a code: ``en`` of ``en-gb``."""
    return language.partition("-")[0]
