"""The request: all options of a clip's speech and motion.

The flags of the command line are generated from `OPTIONS`. The module imports no numeric library.
"""

from collections.abc import Iterable, Mapping
from dataclasses import Field, dataclass, fields
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from lexicon.errors import InputError
from lexicon.values.checks import format_value
from lexicon.values.fields import check_fields
from tts2face.exclusions import check_exclusions
from tts2face.option import check_option_limits, option
from tts2face.source import SOURCE_OPTIONS, Listening, Source, Spoken, make_source, parse_articulation

FPS_LIMITS = (1.0, 120.0)
SYNTHESIS_METHODS = ("exemplar", "theobald2007")
FIELDS = "fields"
GESTURES = (FIELDS, "ju2008", "noise", "none")
CONVERSATION, CAMERA = GAZES = ("conversation", "camera")
OWN_FACE = "self"  # name of the talker's own face
DRAWN_FACE, REALISTIC_FACE = "ada", "head"  # the shipped face that is shown by default, and the one with identities
# Order of flags, of fields over HTTP and of lists in messages.
ORDER = (
    "text", "audio", "audio_map", "language", "voice", "rate", "lead", "plain_delivery", "volume", "seed", "dictionary",
    "synthesis", "context", "exemplars", "articulation", "fps", "gestures", "style", "gain", "expression", "timeline",
    "pitch", "gaze", "idle", "listen", "partner",
)  # fmt: skip


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
    seed: int = option(0, "Seed of all random numbers; the same seed gives the same sound and motion.")
    dictionary: Path | None = option(None, "Pronunciation dictionary that takes precedence over the built-in one.")
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
        None, "Style of the gestures: one name, or one for each feature (brows=annoyed,head=delighted)."
    )
    gain: str | None = option(
        None, "Gain of each feature's motion, 0 to 3: head=1.5,blink=0.8; jaw and lips too; all sets every gesture."
    )
    expression: str | None = option(
        None,
        "Expressions to add (sad, happy, afraid, angry, surprised) with weights and times in seconds: "
        "happy=0.6@1.2-3.4,sad=0.3; or video: the smile of the person in the video of --audio (extra capture).",
    )
    timeline: Path | None = option(None, "JSON file with styles, expressions, nods and gains over time.")
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
        if self.synthesis not in SYNTHESIS_METHODS:
            raise InputError(f"there is no synthesis {self.synthesis!r}; choose {' or '.join(SYNTHESIS_METHODS)}")
        if self.seed < 0:
            raise InputError(f"seed must be 0 or more, not {self.seed}")
        if self.gestures not in GESTURES:
            raise InputError(f"gestures must be {', '.join(GESTURES[:-1])} or {GESTURES[-1]}, not {self.gestures!r}")
        if self.gaze not in GAZES:
            raise InputError(f"there is no gaze {self.gaze!r}; choose {' or '.join(GAZES)}")
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
