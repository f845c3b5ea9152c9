"""Segments: the units that are rendered once and kept by their content address."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

from lexicon.languages import language_code
from tts2face.models.face_names import BALD
from tts2face.request import OWN_FACE, Request
from tts2face.serving.batch.audio_track import open_track
from tts2face.serving.batch.content_address import content_address, file_hash, model_hash, program_version
from tts2face.session.named_models import Models
from tts2face.sound.fitting import fitting_voice
from tts2face.sound.voice_urls import is_voice_url
from tts2face.types import SOUND_RATE, exact_rate, first_sample

SEGMENT_SUFFIX = ".mov"
# Media of stored segments: H.264, VP9, or motion for exports.
MOVIE = "movie"
ALPHA_MOVIE = "vp9"
TRACK = "track"
FILE_PREFIX = "file."  # of the medium of a whole clip in a format of `Session.stream_file`
REQUEST_FILES = ("audio", "partner", "dictionary", "text_marks", "voice", "timeline")
OPTIONAL = ("hair", "hair_color", "person")  # of models; not part of the addresses of segments without them


@dataclass(frozen=True, slots=True)
class CuePart:
    """One cue of a sentence that runs over several: letters of its words, and frames as those of `Segment`."""

    n_letters: int
    window_frames: int
    slot_frames: int | None
    lead_frames: int


@dataclass(frozen=True)
class Segment:
    """A unit of rendering: the words of a cue, a recording, or silence between cues.

    Parameters
    ----------
    request
        Fields of `Request` that differ from their defaults; JSON values.
    picture
        Fields of `Picture` that differ from their defaults.
    window_frames
        Frames of the cue, into which its speech should fit.
    slot_frames
        Frames up to the next cue: longest length of the segment; None: as long as its speech.
    fills_slot
        Whether the segment is `slot_frames` long (a part of a longer clip), or as short as its speech and cue allow.
    overflow, max_rate, min_rate, max_overlap
        As `BatchOptions`.
    is_shared
        Whether the next cue is of the same speaker.
    silence_s
        Seconds, up to `max_overlap`, between the end of its slot and the next cue.
    parts, part
        The cues of a sentence that is spoken as one, whose words are those of the request, and which of them this is;
        empty: the words are those of this cue.
    audio_begin
        Sample, at `SOUND_RATE`, at which the segment begins in the recording of a whole file; None: the recording is
        one of this segment.
    lead_frames
        Frames before the cue, after which its first sound is heard: silence of the voice or of a recording of the cue
        is cut or added; None: nothing is.
    medium
        What is stored: `MOVIE` (H.264), `ALPHA_MOVIE` (VP9), `TRACK`, a lossless track for exports, or a whole clip:
        `FILE_PREFIX` and a format; its lengths have no effect.
    """

    request: Mapping[str, Any]
    picture: Mapping[str, Any]
    models: Models
    window_frames: int
    slot_frames: int | None = None
    fills_slot: bool = True
    overflow: str = "extend"
    max_rate: float = 1.4
    file_hashes: Mapping[str, str] = field(default_factory=dict)
    audio_begin: int | None = None
    lead_frames: int | None = None
    medium: str = MOVIE
    min_rate: float = 1.0
    max_overlap: float = 0.0
    is_shared: bool = False
    parts: tuple[CuePart, ...] = ()
    part: int = 0
    silence_s: float = 0.0

    @cached_property
    def address(self) -> str:
        """Content address: equal for segments with equal pictures and sound."""
        content = {name: value for name, value in self.as_json().items() if name not in ("models", "audio_begin")}
        if self.medium == MOVIE:
            del content["medium"]
        if not self.silence_s:
            del content["silence_s"]
        content["request"] = {name: self.file_hashes.get(name, value) for name, value in self.request.items()}
        content["picture"] = {name: self.file_hashes.get(name, value) for name, value in self.picture.items()}
        content["identity"] = self.models.identity
        content |= {name: value for name in OPTIONAL if (value := getattr(self.models, name)) is not None}
        if self.request.get("text") and "voice" not in self.request and (fitted := self._fitted_voice()):
            content["fitted"] = fitted  # another one where other voices are installed
        return content_address(content | {"versions": program_version()})

    def _fitted_voice(self) -> str:
        """Voice that fits the face, and what is changed of it; empty where it is the usual one of the language."""
        language = language_code(str(self.request.get("language", Request().language)))
        fitting = fitting_voice(self.models.shown_person(), language)
        return fitting.described if fitting.sentence else ""

    def as_json(self) -> dict[str, Any]:
        """JSON object from which `segment_from_json` makes the segment again."""
        return {
            "request": dict(self.request),
            "picture": dict(self.picture),
            "models": asdict(self.models),
            "window_frames": self.window_frames,
            "slot_frames": self.slot_frames,
            "fills_slot": self.fills_slot,
            "overflow": self.overflow,
            "max_rate": self.max_rate,
            "file_hashes": dict(self.file_hashes),
            "audio_begin": self.audio_begin,
            "lead_frames": self.lead_frames,
            "medium": self.medium,
            "min_rate": self.min_rate,
            "max_overlap": self.max_overlap,
            "is_shared": self.is_shared,
            "parts": [asdict(part) for part in self.parts],
            "part": self.part,
            "silence_s": self.silence_s,
        }

    def as_track(self) -> "Segment":
        """The same segment as a track, which does not depend on the picture."""
        hashes = {name: value for name, value in self.file_hashes.items() if name != "background"}
        return replace(self, medium=TRACK, picture={}, file_hashes=hashes)

    @property
    def audio_end(self) -> int:
        """Sample at which an excerpt ends."""
        fps = exact_rate(float(self.request.get("fps", Request().fps)))
        return (self.audio_begin or 0) + first_sample(self.window_frames, SOUND_RATE, fps)

    def input_hashes(self) -> dict[str, str]:
        """Hashes of all files that the segment reads, by their names; of an excerpt, the hash of its samples.

        Raises
        ------
        InputError, DataError
            A model or file does not exist, or a recording cannot be read.
        """
        if self.audio_begin is None:
            return input_hashes(self.models, self.request, self.picture)

        others = {name: value for name, value in self.request.items() if name != "audio"}
        excerpt = open_track(Path(str(self.request["audio"]))).excerpt_hash(self.audio_begin, self.audio_end)
        return input_hashes(self.models, others, self.picture) | {"audio": excerpt}


def segment_from_json(content: Mapping[str, Any]) -> Segment:
    """The segment of `Segment.as_json`."""
    parts = tuple(CuePart(**part) for part in content.get("parts", ()))
    return Segment(**{**content, "models": Models(**content["models"]), "parts": parts})


def input_hashes(models: Models, request: Mapping[str, Any], picture: Mapping[str, Any]) -> dict[str, str]:
    """Hashes of all files that a segment reads, by their names.

    Raises
    ------
    InputError
        A model or file does not exist.
    """
    hashes = {"talker": model_hash(models.talker, "talker"), "palette": model_hash(str(models.palette), "palette")}
    hashes["face"] = OWN_FACE if models.face == OWN_FACE else model_hash(models.face, "face")
    if models.hair not in (None, BALD):
        hashes["hair"] = model_hash(str(models.hair), "hair")
    for name in REQUEST_FILES:
        value = request.get(name)
        if value is not None and (name != "voice" or (Path(str(value)).suffix and not is_voice_url(value))):
            hashes[name] = file_hash(Path(str(value)))
    background = picture.get("background")
    if background is not None and Path(str(background)).suffix:
        hashes["background"] = file_hash(Path(str(background)))
    return hashes
