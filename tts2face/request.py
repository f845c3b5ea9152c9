"""The Request: the single list of options for what is said and how the face moves.

Flags, JSON fields and studio controls are made from these fields and their help texts. Imports nothing heavy.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from lexicon.errors import InputError

RATE_LIMITS = (0.5, 2.0)
VOLUME_LIMITS = (0.0, 2.0)
FPS_LIMITS = (1.0, 120.0)
AUDIO_MAP_NAMES = ("linear", "network")
SYNTHESIS_METHODS = ("exemplar", "theobald2007")
GESTURES = ("fields", "ju2008", "noise", "none")
IDLE_LIMITS_S = (0.1, 3600.0)


def option(default: Any, help_text: str) -> Any:
    """A dataclass field that carries its own help text."""
    return field(default=default, metadata={"help": help_text})


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """What is said, by which voice, and how the face moves with it.

    With ``audio`` a recording is heard in place of a voice; ``text`` then is what is said in it, or empty.
    ``language`` is kept as the espeak-ng code of what is given (`lexicon.languages.language_code`).

    Raises
    ------
    InputError
        There is no such language, a number lies outside its range, or an option belongs to a voice where there is a
        recording.
    """

    text: str = option("", "What to say.")
    audio: Path | None = option(
        None, "A recording of a voice (any sound or video file) that the lips follow; best with its words as text."
    )
    drive: str | None = option(
        None,
        "How lips follow a recording without its words: network (default, best for the talker's own voice) or linear "
        "(moves them less, steadier with other voices).",
    )
    language: str = option(
        "en-us",
        "Language of the text: a code (en-us, de), a tag (pt-BR, zh-Hans) or a name (German); `tts2face languages` "
        "lists all. Chinese characters in Japanese need the extra japanese.",
    )
    voice: str | None = option(
        None, "heart (English), espeak or espeak-female (every language), or a Piper voice (x.onnx)."
    )
    rate: float = option(1.0, "Speed of speech, 0.5 to 2.")
    volume: float = option(1.0, "Loudness of the sound, 0 to 2; 1 is -16 LUFS, or a recording as it is.")
    seed: int = option(0, "The same seed gives the same sound and motion.")
    dictionary: Path | None = option(None, "Your own pronunciations, which win over the built-in ones.")
    synthesis: str = option("exemplar", "How lips are made from exemplars: exemplar, or theobald2007 as published.")
    context: int | None = option(None, "Phones either side by which exemplars are chosen; the method's own without it.")
    exemplars: int | None = option(None, "Exemplars averaged for each phone; the method's own without it.")
    fps: float = option(30.0, "Frames per second, 1 to 120.")
    gestures: str = option(
        "fields",
        "How face and head move with the speech: fields, ju2008 (fields as published), noise (Perlin, for comparison), "
        "or none (only the lips move).",
    )
    style: str | None = option(
        None, "Style of the gestures: a name, or names by feature (brows=annoyed,head=delighted)."
    )
    gain: str | None = option(
        None, "How far features move, 0 to 3: head=1.5,blink=0.8; jaw and lips too; all for every gesture."
    )
    expression: str | None = option(
        None,
        "Expressions added (sad, happy, afraid, angry, surprised), with weight and seconds: happy=0.6@1.2-3.4,sad=0.3.",
    )
    timeline: Path | None = option(None, "A JSON file with styles, expressions, nods and gains over time.")
    pitch: bool = option(False, "Gestures follow the pitch of the voice, not only its loudness.")
    idle: float | None = option(None, "Seconds of a living, silent face, in place of a text.")

    @property
    def has_gestures(self) -> bool:
        """Whether face and head move beside the lips."""
        return self.gestures != "none"

    def __post_init__(self) -> None:
        """Refuse numbers outside their range."""
        from lexicon.languages import language_code

        object.__setattr__(self, "language", language_code(self.language))
        _check_limits("rate", self.rate, RATE_LIMITS)
        _check_limits("volume", self.volume, VOLUME_LIMITS)
        _check_limits("fps", self.fps, FPS_LIMITS)
        if self.synthesis not in SYNTHESIS_METHODS:
            raise InputError(f"there is no synthesis {self.synthesis!r}; choose {' or '.join(SYNTHESIS_METHODS)}")
        if self.seed < 0:
            raise InputError(f"seed must be 0 or more, not {self.seed}")
        if self.drive is not None:
            _check_audio_map(self)
        if self.audio is not None and (self.voice is not None or self.rate != 1.0):
            raise InputError("a recording keeps its own voice and speed; leave --voice and --rate away")
        if self.idle is not None:
            _check_limits("idle", self.idle, IDLE_LIMITS_S)
            _check_idle(self)
        _check_gestures(self)


def _check_audio_map(request: Request) -> None:
    if request.drive not in AUDIO_MAP_NAMES:
        raise InputError(f"there is no drive {request.drive!r}; choose {' or '.join(AUDIO_MAP_NAMES)}")
    if request.audio is None:
        raise InputError("a drive follows a recording; give one with --audio, or leave --drive away")
    if request.text.strip():
        raise InputError("where the words are known the lips follow them; leave --drive or the text away")


def _check_gestures(request: Request) -> None:
    if request.gestures not in GESTURES:
        raise InputError(f"gestures must be {', '.join(GESTURES[:-1])} or {GESTURES[-1]}, not {request.gestures!r}")
    if request.gestures == "noise" and request.pitch:
        raise InputError("--pitch has no effect with --gestures noise; remove one of them")
    asked = (request.style, request.gain, request.expression, request.timeline, request.pitch)
    if request.gestures == "none" and asked != (None, None, None, None, False):
        raise InputError(
            "without gestures there is nothing to style; remove --style, --gain, --expression, --timeline and --pitch, "
            "or choose --gestures fields"
        )


def _check_idle(request: Request) -> None:
    if request.text.strip() or request.audio is not None:
        raise InputError("an idle face is silent; leave the text and --audio away, or --idle")
    if (request.voice, request.rate, request.volume) != (None, 1.0, 1.0):
        raise InputError("an idle face says nothing; leave --voice, --rate and --volume away")


def _check_limits(name: str, value: float, limits: tuple[float, float]) -> None:
    low, high = limits
    if not low <= value <= high:
        raise InputError(f"{name} must lie between {low:g} and {high:g}, not {value:g}")
