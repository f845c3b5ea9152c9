"""The request: all options of a clip's speech and motion.

The flags of the command line are generated from the fields and their help texts. The module imports no numeric library.
"""

from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from lexicon.errors import InputError
from lexicon.marked_text import RATE_LIMITS, VOLUME_LIMITS
from lexicon.values.checks import check_limits, is_number
from lexicon.values.fields import check_fields

FPS_LIMITS = (1.0, 120.0)
RECOGNISED = "phones"
AUDIO_MAP_NAMES = (RECOGNISED, "voices", "network", "linear")
SYNTHESIS_METHODS = ("exemplar", "theobald2007")
FIELDS = "fields"
GESTURES = (FIELDS, "ju2008", "noise", "none")
CONVERSATION, CAMERA = GAZES = ("conversation", "camera")
IDLE_LIMITS_S = (0.1, 3600.0)
NATURAL, CLEAR = 1.0, 1.5  # factors of articulation
ARTICULATIONS = {"natural": NATURAL, "clear": CLEAR}
ARTICULATION_LIMITS = (0.5, 2.0)
LEAD_S = 0.1  # from the start of a clip to its first sound: three frames at 30 Hz, in which the lips open
TURN_S = 0.3  # at least, after listening: a breath of less is not seen; gaps between turns of people are .2 s
LEAD_LIMITS_S = (0.0, 1.0)
OWN_FACE = "self"  # name of the talker's own face
DRAWN_FACE, REALISTIC_FACE = "ada", "head"  # the shipped face that is shown by default, and the one with identities


def option(default: Any, help_text: str, *, limits: tuple[float, float] | None = None, choices: Any = ()) -> Any:
    """Dataclass field with a default value, and in its metadata a help text, limits of a number and names to choose.

    Flags, and fields of requests over HTTP, are made from it.
    """
    return field(default=default, metadata={"help": help_text, "limits": limits, "choices": tuple(choices)})


def check_option_limits(options: Any) -> None:
    """Refuse numbers of a dataclass of options that lie outside their limits (`InputError`)."""
    for one in fields(options):
        value, limits = getattr(options, one.name), one.metadata["limits"]
        if limits is not None and value is not None:
            check_limits(one.name, value, limits)


@dataclass(frozen=True, slots=True, kw_only=True)
class Request:
    """Options of a clip: text or recording, voice, lip motion and gestures.

    If ``audio`` is given, the clip uses the sound of that recording, and ``text`` is its transcript or empty.
    ``lead`` is None where the voice's own silence is kept.
    ``language`` is converted to an espeak-ng code (`lexicon.languages.language_code`).

    Raises
    ------
    InputError
        An option has a value of another type, the language does not exist, a number lies outside its range, or two
        options exclude each other.
    """

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
    language: str = option(
        "en-us",
        "Language of the text: a code (en-us, de), a tag (pt-BR, zh-Hans) or a name (German); `tts2face languages` "
        "lists all. Chinese characters in Japanese text need the extra japanese.",
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
    articulation: str | None = option(
        None,
        "Rounding, spreading and opening of the mouth: natural (as the talker; 1), clear (1.5), or a factor, 0.5 to 2; "
        "default: clear on a mesh, natural on a talker's own face.",
    )
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
    idle: float | None = option(None, "Seconds of idle animation instead of speech.", limits=IDLE_LIMITS_S)
    listen: float | None = option(
        None, "Seconds for which the face listens, before its text if there is one.", limits=IDLE_LIMITS_S
    )
    partner: Path | None = option(
        None, "Sound of the person to whom the face listens (--listen), at whose pauses and falls of pitch it responds."
    )

    @property
    def has_phones(self) -> bool:
        """Whether lips follow phones: of the text, or recognised in a recording."""
        return bool(self.text.strip()) or self.audio_map in {None, RECOGNISED}

    @property
    def articulation_factor(self) -> float | None:
        """Factor of rounding, spreading and opening; None for the default of the face."""
        return None if self.articulation is None else parse_articulation(self.articulation)

    @property
    def has_gestures(self) -> bool:
        """Whether gestures are added to the lip motion."""
        return self.gestures != "none"

    @property
    def is_text(self) -> bool:
        """Whether a text is spoken by a voice, in place of a recording, or of idle animation or listening alone."""
        return self.audio is None and self.idle is None and (self.listen is None or bool(self.text.strip()))

    @property
    def silence(self) -> float | None:
        """Seconds of idle animation, or of listening; None where there are neither."""
        return self.listen if self.idle is None else self.idle

    def __post_init__(self) -> None:
        """Reject values of other types, numbers outside their range, and options that exclude each other."""
        from lexicon.languages import language_code

        if is_number(self.articulation):
            object.__setattr__(self, "articulation", f"{self.articulation:g}")
        check_fields(self)
        object.__setattr__(self, "language", language_code(self.language))
        check_option_limits(self)
        if self.synthesis not in SYNTHESIS_METHODS:
            raise InputError(f"there is no synthesis {self.synthesis!r}; choose {' or '.join(SYNTHESIS_METHODS)}")
        _check_articulation(self)
        if self.seed < 0:
            raise InputError(f"seed must be 0 or more, not {self.seed}")
        if self.audio_map is not None:
            _check_audio_map(self)
        if self.audio is not None and (self.voice, self.rate, self.lead) != (None, 1.0, LEAD_S):
            raise InputError("--voice, --rate and --lead have no effect on a recording; remove them or --audio")
        if self.idle is not None:
            _check_idle(self)
        _check_listening(self)
        _check_gestures(self)


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


def _check_articulation(request: Request) -> None:
    if request.articulation is None:
        return
    parse_articulation(request.articulation)
    if request.idle is not None:
        raise InputError("--articulation has no effect with --idle; remove one of them")
    if request.audio is not None and not request.has_phones:
        raise InputError("--articulation needs the phones of a recording; remove it, or --audio-map")


def _check_audio_map(request: Request) -> None:
    if request.audio_map not in AUDIO_MAP_NAMES:
        raise InputError(f"there is no audio map {request.audio_map!r}; choose {', '.join(AUDIO_MAP_NAMES)}")
    if request.audio is None:
        raise InputError("--audio-map needs a recording; add --audio or remove --audio-map")
    if request.text.strip():
        raise InputError("--audio-map has no effect if the words are given; remove --audio-map or the text")


def _check_gestures(request: Request) -> None:
    if request.gestures not in GESTURES:
        raise InputError(f"gestures must be {', '.join(GESTURES[:-1])} or {GESTURES[-1]}, not {request.gestures!r}")
    if request.gestures == "noise" and request.pitch:
        raise InputError("--pitch has no effect with --gestures noise; remove one of them")
    gesture_options = (request.style, request.gain, request.expression, request.timeline, request.pitch)
    if request.gaze not in GAZES:
        raise InputError(f"there is no gaze {request.gaze!r}; choose {' or '.join(GAZES)}")
    if request.gestures == "none" and (*gesture_options, request.gaze) != (None, None, None, None, False, CONVERSATION):
        raise InputError(
            "--style, --gain, --expression, --timeline, --pitch and --gaze have no effect with --gestures none; remove "
            "them, or choose --gestures fields"
        )


def _check_listening(request: Request) -> None:
    if request.partner is not None and request.listen is None:
        raise InputError("--partner needs a face that listens; add --listen with the seconds, or remove it")
    if request.listen is None:
        return
    if request.audio is not None or request.idle is not None:
        raise InputError("--listen cannot be combined with --audio or --idle; remove one of them")
    speech = (request.voice, request.rate, request.volume, request.lead)
    if not request.text.strip() and speech != (None, 1.0, 1.0, LEAD_S):
        raise InputError("--voice, --rate, --volume and --lead need a text after --listen; add one, or remove them")


def _check_idle(request: Request) -> None:
    if request.text.strip() or request.audio is not None:
        raise InputError("--idle cannot be combined with text or --audio; remove one of them")
    if (request.voice, request.rate, request.volume, request.lead) != (None, 1.0, 1.0, LEAD_S):
        raise InputError("--voice, --rate, --volume and --lead have no effect with --idle; remove them")
