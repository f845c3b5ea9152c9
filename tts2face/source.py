"""Sources of a clip: a text, a recording, idle animation, or listening, each with the options that it has.

`make_source` makes one of the options by name that flags, files and clients give (`SourceOptions`).
"""

from dataclasses import Field, dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

from lexicon.errors import InputError
from lexicon.marked_text import RATE_LIMITS, VOLUME_LIMITS
from lexicon.values.checks import check_limits, is_number
from lexicon.values.fields import check_fields
from tts2face.exclusions import check_exclusions
from tts2face.option import check_option_limits, option

RECOGNISED = "phones"
AUDIO_MAP_NAMES = (RECOGNISED, "voices", "network", "linear")
IDLE_LIMITS_S = (0.1, 3600.0)
NATURAL, CLEAR = 1.0, 1.5  # factors of articulation
ARTICULATIONS = {"natural": NATURAL, "clear": CLEAR}
ARTICULATION_LIMITS = (0.5, 2.0)
LEAD_S = 0.1  # from the start of a clip to its first sound: three frames at 30 Hz, in which the lips open
TURN_S = 0.3  # at least, after listening: a breath of less is not seen; gaps between turns of people are .2 s
LEAD_LIMITS_S = (0.0, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceOptions:
    """Options of all sources by name, as flags, files and clients give them: any may be given."""

    text: str = option("", "Text to speak.")
    audio: Path | None = option(
        None,
        "Recorded speech (any sound or video file) that the lips follow in place of a synthesised voice; most accurate "
        "if its words are given as text.",
    )
    audio_map: str | None = option(
        None,
        "How a recording without a transcript moves the lips: phones (default: English phones are recognised and "
        "spoken as those of a text), or the talker's map from sound, as for live sound: voices (of anybody), network "
        "(for its own voice) or linear.",
        choices=AUDIO_MAP_NAMES,
    )
    voice: str | None = option(
        None, "Voice: heart or joe (English), espeak or espeak-female (every language), or a Piper voice (x.onnx)."
    )
    rate: float = option(1.0, "Speaking rate as a factor, 0.5 to 2.", limits=RATE_LIMITS)
    lead: float | None = option(
        LEAD_S, "Seconds from the start of the clip to the first sound, in which the lips open, 0 to 1.",
        limits=LEAD_LIMITS_S,
    )  # fmt: skip
    plain_delivery: bool = option(
        False, "Keep the voice's rate and loudness under every style; --rate and --volume do so for themselves."
    )
    volume: float = option(
        1.0,
        "Loudness as a factor, 0 to 2; 1 is -16 LUFS, or the original level of a recording.",
        limits=VOLUME_LIMITS,
    )
    articulation: str | None = option(
        None,
        "Rounding, spreading and opening of the mouth: natural (as the talker; 1), clear (1.5), or a factor, 0.5 to 2; "
        "default: clear on a mesh, natural on a talker's own face.",
    )
    idle: float | None = option(None, "Seconds of idle animation instead of speech.", limits=IDLE_LIMITS_S)
    listen: float | None = option(
        None, "Seconds for which the face listens, before its text if there is one.", limits=IDLE_LIMITS_S
    )
    partner: Path | None = option(
        None, "Sound of the person to whom the face listens (--listen), at whose pauses and falls of pitch it responds."
    )

    def __post_init__(self) -> None:
        """Refuse values of other types, numbers outside their range, and options that exclude each other."""
        if is_number(self.articulation):
            object.__setattr__(self, "articulation", f"{self.articulation:g}")
        check_fields(self)
        check_option_limits(self)
        if self.articulation is not None:
            parse_articulation(self.articulation)
        if self.audio_map not in {None, *AUDIO_MAP_NAMES}:
            raise InputError(f"there is no audio map {self.audio_map!r}; choose {', '.join(AUDIO_MAP_NAMES)}")
        check_exclusions(self)


SOURCE_OPTIONS = {declared.name: declared for declared in fields(SourceOptions)}


def parse_articulation(given: str) -> float:
    """Factor of an articulation: natural, clear, or a number.

    Raises
    ------
    InputError
        It is neither a name nor a number from 0.5 to 2.
    """
    if given in ARTICULATIONS:
        return ARTICULATIONS[given]
    try:
        factor = float(given)
    except ValueError:
        raise InputError(f"articulation must be natural, clear or a factor from 0.5 to 2, not {given!r}") from None
    check_limits("articulation", factor, ARTICULATION_LIMITS)
    return factor


class CheckedOptions:
    """Options of one source, which refuse values of other types and numbers outside the limits (`InputError`)."""

    __slots__ = ()
    __dataclass_fields__: ClassVar[dict[str, "Field[Any]"]]

    def __post_init__(self) -> None:
        """Refuse them by the names and limits of `SourceOptions`."""
        check_fields(self)
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
    lead: float | None = LEAD_S
    plain_delivery: bool = False
    volume: float = 1.0
    articulation: str | None = None


@dataclass(frozen=True, slots=True)
class FromPhones(CheckedOptions):
    """Lips of a recording that follow its phones: of its words, or recognised where these are not known."""

    text: str = ""
    articulation: str | None = None


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
            return Recorded(given.audio, FromPhones("" if is_blank else given.text, given.articulation), given.volume)
        return Recorded(given.audio, FromSound(str(given.audio_map)), given.volume)
    spoken = Spoken(
        given.text, given.voice, given.rate, given.lead, given.plain_delivery, given.volume, given.articulation
    )
    if given.listen is None:
        return spoken
    return Listening(given.listen, given.partner, None if is_blank else spoken)
