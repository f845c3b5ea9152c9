"""Options of all sources of a clip by name, as flags, files and clients give them."""

from dataclasses import dataclass, fields
from pathlib import Path

from lexicon.marked_text import PITCH_LIMITS, RANGE_LIMITS, RATE_LIMITS, VOLUME_LIMITS
from lexicon.values.checks import is_number
from lexicon.values.fields import check_fields
from tts2face.articulation import parse_articulation
from tts2face.exclusions import check_exclusions
from tts2face.option import check_choices, check_option_limits, option

AUTO_MARKUP = "auto"
AUTO_STYLE = "auto"  # the style that follows the words (`lexicon.moods`)
MARKUPS = (AUTO_MARKUP, "plain", "ssml", "llm")  # as `lexicon.text_marks.MARKUPS`, which is not loaded for flags
RECOGNISED = "phones"
AUDIO_MAP_NAMES = (RECOGNISED, "voices", "network", "linear")
IDLE_LIMITS_S = (0.01, 3600.0)
LEAD_S = 0.1  # from the start of a clip to its first sound: three frames at 30 Hz, in which the lips open
LEAD_LIMITS_S = (0.0, 1.0)
AUTO = "auto"  # the voice that fits the face, as where none is named


def is_auto(style: str | None) -> bool:
    """Whether a style is that of the words."""
    return style is not None and style.strip() == AUTO_STYLE


@dataclass(frozen=True, slots=True, kw_only=True)
class SourceOptions:
    """Options of all sources by name, as flags, files and clients give them: any may be given."""

    text: str = option("", "Text to speak.")
    markup: str = option(
        AUTO_MARKUP,
        "How the text is read: auto (as SSML if it begins with <speak, else with its marks, emoji and Markdown), plain "
        "(no marks), ssml (also without <speak> around it), or llm (as auto, for the text of a language model).",
        choices=MARKUPS,
    )
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
        None,
        "Voice: auto (fits the face), one of `tts2face voices`, a Piper voice (x.onnx), or a server's URL.",
    )
    rate: float = option(1.0, "Speaking rate as a factor, 0.5 to 2.", limits=RATE_LIMITS)
    voice_pitch: float = option(0.0, "Semitones added to the pitch of the voice, -12 to 12.", limits=PITCH_LIMITS)
    voice_range: float = option(
        1.0, "Range of the voice's pitch as a factor, 0 (on one tone) to 2.", limits=RANGE_LIMITS
    )
    lead: float | None = option(
        LEAD_S, "Seconds from the start of the clip to the first sound, in which the lips open, 0 to 1.",
        limits=LEAD_LIMITS_S,
    )  # fmt: skip
    spoken_mark: str | None = option(
        None,
        "Words before the text that say that the voice is synthetic: auto for a sentence in the language of the text, "
        "or one's own.",
    )
    plain_delivery: bool = option(
        False,
        "Keep the voice's rate, pitch and loudness under every style; --rate, --voice-pitch, --voice-range and "
        "--volume do so for themselves.",
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
        if self.voice == AUTO:
            object.__setattr__(self, "voice", None)
        if is_number(self.articulation):
            object.__setattr__(self, "articulation", f"{self.articulation:g}")
        check_fields(self)
        check_option_limits(self)
        if self.articulation is not None:
            parse_articulation(self.articulation)
        check_choices(self, "audio_map", "markup")
        check_exclusions(self)


SOURCE_OPTIONS = {declared.name: declared for declared in fields(SourceOptions)}
