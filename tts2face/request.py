"""The request: all options of a clip's speech and motion.

The flags of the command line are generated from `OPTIONS`; `make_source` makes a source of `SourceOptions`. The module
imports no numeric library.
"""

from collections.abc import Iterable, Mapping
from dataclasses import Field, dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar

from lexicon.errors import InputError
from lexicon.values.checks import check_limits, format_value
from lexicon.values.fields import check_fields
from tts2face.articulation import parse_articulation
from tts2face.exclusions import check_exclusions
from tts2face.option import check_choices, check_option_limits, option
from tts2face.source_options import AUTO, AUTO_MARKUP, LEAD_S, RECOGNISED, SOURCE_OPTIONS, SourceOptions

TURN_S = 0.3  # at least, after listening: a breath of less is not seen; gaps between turns of people are .2 s
FPS_LIMITS = (1.0, 120.0)
SYNTHESIS_METHODS = ("exemplar", "theobald2007")
FIELDS = "fields"
GESTURES = (FIELDS, "ju2008", "noise", "none")
CONVERSATION, CAMERA = GAZES = ("conversation", "camera")
OWN_FACE = "self"  # name of the talker's own face
DRAWN_FACE, REALISTIC_FACE = "ada", "head"  # the shipped face that is shown by default, and the one with identities
# Order of flags, of fields over HTTP and of lists in messages.
ORDER = (
    "text", "markup", "audio", "audio_map", "language", "voice", "rate", "voice_pitch", "voice_range", "lead",
    "plain_delivery", "spoken_mark", "volume", "seed", "dictionary", "text_marks", "synthesis", "context", "exemplars",
    "articulation", "fps", "gestures", "style", "gain", "expression", "timeline", "pitch", "gaze", "idle", "listen",
    "partner",
)  # fmt: skip


class CheckedOptions:
    """Options of one source, which refuse values of other types and numbers outside the limits (`InputError`)."""

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, "Field[Any]"]]

    def __post_init__(self) -> None:
        """Refuse them by the names and limits of `SourceOptions`."""
        check_fields(self)
        if self.as_options().get("voice") == AUTO:
            object.__setattr__(self, "voice", None)
        for name, value in self.as_options().items():
            limits = SOURCE_OPTIONS[name].metadata["limits"]
            if limits is not None and value is not None:
                check_limits(name, value, limits)
            if name == "articulation" and value is not None:
                parse_articulation(value)

    def as_options(self) -> dict[str, Any]:
        """Its options by name."""
        return {declared.name: getattr(self, declared.name) for declared in fields(self)}


@dataclass(frozen=True, slots=True)
class Spoken(CheckedOptions):
    """A text that a voice speaks; ``lead`` is None where the voice's own silence is kept."""

    text: str
    voice: str | None = None
    rate: float = 1.0
    voice_pitch: float = 0.0
    voice_range: float = 1.0
    lead: float | None = LEAD_S
    spoken_mark: str | None = None
    plain_delivery: bool = False
    volume: float = 1.0
    articulation: str | None = None
    markup: str = AUTO_MARKUP


@dataclass(frozen=True, slots=True)
class FromPhones(CheckedOptions):
    """Lips of a recording that follow its phones: of its words, or recognised where these are not known."""

    text: str = ""
    articulation: str | None = None
    markup: str = AUTO_MARKUP


@dataclass(frozen=True, slots=True)
class FromSound(CheckedOptions):
    """Lips of a recording that follow its sound, by one of the talker's maps."""

    audio_map: str
    text: ClassVar[str] = ""
    articulation: ClassVar[str | None] = None


@dataclass(frozen=True, slots=True)
class Recorded(CheckedOptions):
    """Recorded speech, which the lips follow."""

    audio: Path
    lips: FromPhones | FromSound = FromPhones()
    volume: float = 1.0

    @property
    def text(self) -> str:
        """Words of the recording; empty where they are not known."""
        return self.lips.text

    @property
    def articulation(self) -> str | None:
        """Articulation of its phones."""
        return self.lips.articulation

    def as_options(self) -> dict[str, Any]:
        """Its options by name."""
        return {"audio": self.audio, "volume": self.volume, **self.lips.as_options()}


@dataclass(frozen=True, slots=True)
class Idle(CheckedOptions):
    """Seconds of idle animation."""

    seconds: float
    text: ClassVar[str] = ""
    articulation: ClassVar[str | None] = None

    def as_options(self) -> dict[str, Any]:
        """Its options by name."""
        return {"idle": self.seconds}


@dataclass(frozen=True, slots=True)
class Listening(CheckedOptions):
    """Seconds for which the face listens, to the sound of a partner if there is one, and the text that follows."""

    seconds: float
    partner: Path | None = None
    then: Spoken | None = None

    @property
    def text(self) -> str:
        """Text that follows; empty for listening alone."""
        return "" if self.then is None else self.then.text

    @property
    def articulation(self) -> str | None:
        """Articulation of the text that follows."""
        return None if self.then is None else self.then.articulation

    def as_options(self) -> dict[str, Any]:
        """Its options by name."""
        spoken = {} if self.then is None else self.then.as_options()
        return {"listen": self.seconds, "partner": self.partner, **spoken}


Source = Spoken | Recorded | Idle | Listening
ONLY_SPOKEN = {*Spoken("").as_options()} - {*Recorded(Path()).as_options()}  # options that no recording has


def make_source(**options: Any) -> Source:
    """The source of `SourceOptions`, whose options without effect and not refused are left out; errors as there."""
    given = SourceOptions(**options)
    is_blank = not given.text.strip()
    if given.idle is not None:
        return Idle(given.idle)
    if given.audio is not None:
        if given.audio_map in {None, RECOGNISED}:
            lips = FromPhones("" if is_blank else given.text, given.articulation, given.markup)
            return Recorded(given.audio, lips, given.volume)
        return Recorded(given.audio, FromSound(str(given.audio_map)), given.volume)
    spoken = Spoken(**{declared.name: getattr(given, declared.name) for declared in fields(Spoken)})
    if given.listen is None:
        return spoken
    return Listening(given.listen, given.partner, None if is_blank else spoken)


@dataclass(frozen=True, slots=True, kw_only=True, init=False)
class Request:
    """The source of a clip, and options of its language, lip motion and gestures.

    Options of the source may be given and read by name, too: ``Request(text="Hello.", rate=1.2)`` is
    ``Request(source=Spoken("Hello.", rate=1.2))``; beside a source they change it, as with `dataclasses.replace`.
    ``language`` is converted to an espeak-ng code (`lexicon.languages.language_code`).

    A new option:

    1. Is a field with `option` here, which has its help text, limits and choices; one that only some sources have is a
       field of `SourceOptions` and of these sources.
    2. Gets a place in `ORDER`. Flags, fields over HTTP, project files and casts follow.
    3. Gets a row of `EXCLUSIONS` where it has no effect beside others.
    4. Is read by a step of `tts2face.session`, and changes the clip in `tests/doors/test_requests.py`.

    Raises
    ------
    InputError
        An option has a value of another type, the language does not exist, a number lies outside its range, or two
        options exclude each other.
    """

    source: Source
    language: str = option(
        "en-us",
        "Language of the text: a code (en-us, de), a tag (pt-BR, zh-Hans) or a name (German); `tts2face languages` "
        "lists all. Chinese characters in Japanese text need the extra japanese.",
    )
    seed: int | None = option(None, "Seed of all random numbers, for equal sound and motion; default: the face's own.")
    dictionary: Path | None = option(None, "Pronunciation dictionary that takes precedence over the built-in one.")
    text_marks: Path | None = option(
        None, "Table of emoji, emoticons, tags and actions that precede those of `text_marks.tsv`, and what they show."
    )
    synthesis: str = option(
        "exemplar",
        "Method of lip synthesis: exemplar, or theobald2007 (the method as published).",
        choices=SYNTHESIS_METHODS,
    )
    context: int | None = option(
        None, "Number of phones on either side that are compared when exemplars are chosen; default: the method's."
    )
    exemplars: int | None = option(None, "Number of exemplars averaged for each phone; default: the method's.")
    fps: float = option(30.0, "Frames per second, 1 to 120.", limits=FPS_LIMITS)
    gestures: str = option(
        "fields",
        "Method of gesture synthesis: fields, ju2008 (fields as published), noise (Perlin noise, for comparison), or "
        "none (only the lips move).",
        choices=GESTURES,
    )
    style: str | None = option(
        None,
        "Style of the gestures: a name, one for each feature (brows=annoyed,head=delighted), or auto: by the words.",
    )
    gain: str | None = option(
        None, "Gain of each feature's motion, 0 to 3: head=1.5,blink=0.8; jaw and lips too; all sets every gesture."
    )
    expression: str | None = option(
        None,
        "Expressions to add (sad, happy, afraid, angry, surprised) with weights and times in seconds: "
        "happy=0.6@1.2-3.4,sad=0.3; or video: the smile of the person in the video of --audio (extra capture).",
    )
    timeline: Path | None = option(None, "JSON file with styles, expressions, gestures and gains over time.")
    pitch: bool = option(False, "Gestures follow the pitch of the voice in addition to its loudness.")
    gaze: str = option(
        CONVERSATION,
        "Where the eyes of derived styles look: conversation (at the viewer and away, as people who speak or listen), "
        "or camera (always at the viewer).",
        choices=GAZES,
    )

    def __init__(self, *, source: Source | None = None, **options: Any) -> None:
        """Options by name; those of the source make one, or change the one that is given."""
        unknown = options.keys() - set(ORDER)
        if unknown:
            raise TypeError(f"Request.__init__() got an unexpected keyword argument {min(unknown)!r}")
        if source is not None and not isinstance(source, Source):
            raise InputError(f"source must be Spoken, Recorded, Idle or Listening, not {format_value(source)}")
        of_source = {name: options.pop(name) for name in [*options] if name in SOURCE_OPTIONS}
        if source is None or of_source:
            source = make_source(**({} if source is None else source.as_options()) | of_source)
        object.__setattr__(self, "source", source)
        for declared in fields(self)[1:]:
            object.__setattr__(self, declared.name, options.get(declared.name, declared.default))
        self._check()

    def _check(self) -> None:
        """Reject values of other types, numbers outside their range, and options that exclude each other."""
        from lexicon.languages import language_code

        check_fields(self)
        object.__setattr__(self, "language", language_code(self.language))
        check_option_limits(self)
        check_choices(self, "synthesis", "gaze")
        if self.seed is not None and self.seed < 0:
            raise InputError(f"seed must be 0 or more, not {self.seed}")
        if self.gestures not in GESTURES:
            raise InputError(f"gestures must be {', '.join(GESTURES[:-1])} or {GESTURES[-1]}, not {self.gestures!r}")
        check_exclusions(self)

    if not TYPE_CHECKING:  # programs of users may read options by name; the package asks the source

        def __getattr__(self, name: str) -> Any:
            """An option of the source, its default where the source does not have it."""
            if name not in SOURCE_OPTIONS:
                raise AttributeError(f"'Request' object has no attribute {name!r}")
            return self.source.as_options().get(name, SOURCE_OPTIONS[name].default)

    @property
    def articulation_factor(self) -> float | None:
        """Factor of rounding, spreading and opening; None for the default of the face."""
        given = self.source.articulation
        return None if given is None else parse_articulation(given)

    @property
    def known_seed(self) -> int:
        """Seed; 0 until a session sets that of its face."""
        return self.seed or 0

    @property
    def markup(self) -> str:
        """How the text is read."""
        return str(self.source.as_options().get("markup", AUTO_MARKUP))

    @property
    def has_gestures(self) -> bool:
        """Whether gestures are added to the lip motion."""
        return self.gestures != "none"

    @property
    def spoken(self) -> Spoken | None:
        """The text that a voice speaks, alone or after listening; None for a recording and without any."""
        if isinstance(self.source, Listening):
            return self.source.then
        return self.source if isinstance(self.source, Spoken) else None


OPTIONS: Mapping[str, "Field[Any]"] = MappingProxyType({
    name: SOURCE_OPTIONS.get(name) or next(declared for declared in fields(Request) if declared.name == name)
    for name in ORDER
})  # fmt: skip


def option_fields(kind: type) -> Iterable["Field[Any]"]:
    """Fields of a dataclass of options as doors give them: for a `Request`, those of all sources in place of one."""
    return OPTIONS.values() if kind is Request else fields(kind)
