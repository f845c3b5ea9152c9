"""Segments: the units that are rendered once and kept by their content address.

The result of a rendered segment; a module without heavy imports.

Content addresses: a hash of everything that determines a segment.

A recording of a whole subtitle file, such as a dubbing track, of which segments take excerpts.
"""

import hashlib
import json
import wave
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from functools import cached_property, lru_cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from tempfile import TemporaryFile, gettempdir
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from lexicon.errors import DataError, InputError
from tts2face import __version__
from tts2face.models.face_names import BALD
from tts2face.request import OWN_FACE, Request
from tts2face.session.named_models import Models
from tts2face.storage.content_store import content_hash
from tts2face.storage.files import translate_disk_errors
from tts2face.storage.shipped import find_file
from tts2face.types import SOUND_RATE, exact_rate, first_sample
from tts2face.video.media import sound_blocks

SEGMENT_SUFFIX = ".mov"


@dataclass(frozen=True, slots=True)
class SegmentResult:
    """A rendered segment.

    Parameters
    ----------
    n_frames, fps
        Its length.
    rate
        Speaking rate of the fit; 1 for silence and recordings.
    speech_s
        Seconds from its cue to the end of its last word, of an excerpt from its begin; 0 without words.
    overflow_s
        Seconds by which the speech ends after its cue.
    cut_s
        Seconds of speech that is left out or cut off, as the next cue begins.
    warnings
        What does not match the subtitles.
    took_s
        Seconds of work.
    overlap_s
        Seconds of speech that sound on after the next cue has begun.
    """

    n_frames: int
    fps: float
    rate: float = 1.0
    speech_s: float = 0.0
    overflow_s: float = 0.0
    cut_s: float = 0.0
    warnings: tuple[str, ...] = ()
    took_s: float = 0.0
    overlap_s: float = 0.0

    def as_json(self) -> dict[str, Any]:
        """JSON object from which `result_from_json` makes the result again."""
        return asdict(self) | {"warnings": list(self.warnings)}


def result_from_json(content: Mapping[str, Any]) -> SegmentResult:
    """The result of `SegmentResult.as_json`; unknown names are ignored."""
    known = {field.name for field in fields(SegmentResult)}
    found = {name: value for name, value in content.items() if name in known}
    return SegmentResult(**{**found, "warnings": tuple(found.get("warnings", ()))})


SEGMENT_FORMAT = 4  # raised when equal requests give other segments
VOICE_PACKAGES = ("hibari-tts", "onnxruntime", "espeakng-loader", "piper-tts", "hama", "pyopenjtalk-plus", "av")


def content_address(content: Mapping[str, Any]) -> str:
    """SHA-256 of a JSON object, in hexadecimal digits; the order of its names does not matter."""
    text = json.dumps(content, sort_keys=True, ensure_ascii=False, separators=(",", ":"), allow_nan=False)
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()


def file_hash(path: Path) -> str:
    """SHA-256 of a file, kept while its size and time do not change.

    Raises
    ------
    InputError
        The file does not exist or cannot be read.
    """
    try:
        return content_hash(path)
    except OSError as refused:
        raise InputError(f"cannot read {path}: {refused.strerror}; check the path") from refused


def model_hash(name: str, kind: str) -> str:
    """Hash of a talker, face or palette by name or path; errors as `file_hash`."""
    try:
        return file_hash(find_file(name, kind))
    except DataError as wrong:
        raise InputError(str(wrong)) from wrong


@lru_cache(maxsize=1)
def program_version() -> dict[str, str]:
    """Versions of the program and of the packages that determine sound and pictures."""
    found = {"tts2face": __version__, "format": str(SEGMENT_FORMAT)}
    for package in VOICE_PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            continue
    return found


MOVIE, ALPHA_MOVIE, TRACK = "movie", "vp9", "track"  # what a segment is stored as: H.264, VP9, or motion for exports
FILE_PREFIX = "file."  # of the medium of a whole clip in a format of `Session.stream_file`
REQUEST_FILES = ("audio", "partner", "dictionary", "voice", "timeline")
HAIR = ("hair", "hair_color")  # of models; not part of the addresses of segments without them


@dataclass(frozen=True, slots=True)
class Part:
    """One cue of a sentence that runs over several: letters of its words, and frames as those of `Segment`."""

    n_letters: int
    window_frames: int
    slot_frames: int | None
    lead_frames: int


@dataclass(frozen=True)
class Segment:
    """What is rendered: the words of a cue, a recording, or silence between cues.

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
    parts: tuple[Part, ...] = ()
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
        content |= {name: value for name in HAIR if (value := getattr(self.models, name)) is not None}
        return content_address(content | {"versions": program_version()})

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
    parts = tuple(Part(**part) for part in content.get("parts", ()))
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
        if value is not None and (name != "voice" or Path(str(value)).suffix):
            hashes[name] = file_hash(Path(str(value)))
    background = picture.get("background")
    if background is not None and Path(str(background)).suffix:
        hashes["background"] = file_hash(Path(str(background)))
    return hashes


SAMPLE_BYTES = 2


@dataclass(frozen=True, slots=True)
class Track:
    """Sound of a recording on the disk, mono with 16 bits at `SOUND_RATE`; a temporary file without a name."""

    file: IO[bytes]
    n_samples: int

    def __del__(self) -> None:
        """Close the file, which removes it."""
        self.file.close()

    def read(self, begin: int, end: int) -> NDArray[np.int16]:
        """Samples [begin, end); silence before the start and after the end of the recording."""
        samples = np.zeros(max(end - begin, 0), np.int16)
        first, last = max(begin, 0), min(end, self.n_samples)
        if first < last:
            self.file.seek(first * SAMPLE_BYTES)
            content = self.file.read((last - first) * SAMPLE_BYTES)
            samples[first - begin : last - begin] = np.frombuffer(content, np.int16)
        return samples

    def excerpt_hash(self, begin: int, end: int) -> str:
        """SHA-256 of samples [begin, end)."""
        return hashlib.sha256(self.read(begin, end).tobytes()).hexdigest()

    def write_excerpt(self, path: Path, begin: int, end: int) -> None:
        """Write samples [begin, end) as a .wav file."""
        with translate_disk_errors(path), wave.open(str(path), "wb") as file:
            file.setparams((1, SAMPLE_BYTES, SOUND_RATE, 0, "NONE", ""))
            file.writeframes(self.read(begin, end).tobytes())


def open_track(path: Path) -> Track:
    """Track of a recording, which is decoded once; the last one stays open.

    Raises
    ------
    InputError, DataError
        The recording does not exist or cannot be read.
    BackendError
        The disk of temporary files is full; an hour takes 350 MB.
    """
    try:
        status = path.stat()
    except OSError as refused:
        raise InputError(f"cannot read {path}: {refused.strerror}; check the path") from refused
    return _open_track(path, status.st_size, status.st_mtime_ns)


@lru_cache(maxsize=1)
def _open_track(path: Path, _size: int, _time: int) -> Track:
    file = TemporaryFile(prefix="tts2face-")  # noqa: SIM115 - as long as the track is used
    n_samples = 0
    try:
        for block in sound_blocks(path, SOUND_RATE):
            samples = np.round(block * 32767.0).astype(np.int16)
            n_samples += len(samples)
            with translate_disk_errors(Path(gettempdir())):
                file.write(samples.tobytes())
        file.flush()
    except BaseException:
        file.close()
        raise
    return Track(file, n_samples)
