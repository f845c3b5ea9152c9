"""Animation of talking faces from text, recorded speech and videos.

Examples
--------
>>> import tts2face
>>> session = tts2face.Session()  # doctest: +SKIP
>>> session.write("Hello there.", "hello.mp4", style="delighted")  # doctest: +SKIP
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from lexicon.errors import BackendError as BackendError
    from lexicon.errors import DataError as DataError
    from lexicon.errors import InputError as InputError
    from lexicon.errors import Tts2faceError as Tts2faceError
    from lexicon.sequence import PhoneSequence as PhoneSequence
    from lexicon.sequence import WordSpan as WordSpan
    from tts2face.interchange.characters.animation import WrittenCharacter as WrittenCharacter
    from tts2face.interchange.characters.animation import write_character as write_character
    from tts2face.interchange.characters.importing import ImportedFace as ImportedFace
    from tts2face.interchange.characters.importing import ImportReport as ImportReport
    from tts2face.interchange.characters.importing import import_face as import_face
    from tts2face.interchange.characters.saving import save_face as save_face
    from tts2face.interchange.subtitles.cues import Cue as Cue
    from tts2face.interchange.subtitles.cues import Subtitles as Subtitles
    from tts2face.interchange.subtitles.options import SubtitleOptions as SubtitleOptions
    from tts2face.interchange.subtitles.reader import read_subtitles as read_subtitles
    from tts2face.models.face import Face as Face
    from tts2face.models.face_loading import load_face as load_face
    from tts2face.models.palette import Palette as Palette
    from tts2face.models.palette_file import load_palette as load_palette
    from tts2face.models.talker import Talker as Talker
    from tts2face.models.talker_file import load_talker as load_talker
    from tts2face.photo.face_from_photo import face_from_photo as face_from_photo
    from tts2face.picture.options import Picture as Picture
    from tts2face.request import FromPhones as FromPhones
    from tts2face.request import FromSound as FromSound
    from tts2face.request import Idle as Idle
    from tts2face.request import Listening as Listening
    from tts2face.request import Recorded as Recorded
    from tts2face.request import Request as Request
    from tts2face.request import Spoken as Spoken
    from tts2face.serving.batch.cast import Cast as Cast
    from tts2face.serving.batch.cast import read_cast as read_cast
    from tts2face.serving.batch.options import BatchOptions as BatchOptions
    from tts2face.serving.batch.output import Plan as Plan
    from tts2face.serving.batch.plan import plan_batch as plan_batch
    from tts2face.serving.batch.report import measure_plan as measure_plan
    from tts2face.serving.batch.run import BatchResult as BatchResult
    from tts2face.serving.batch.run import run_batch as run_batch
    from tts2face.session.animated_face import AnimatedFace as AnimatedFace
    from tts2face.session.catalogue import faces as faces
    from tts2face.session.catalogue import formats as formats
    from tts2face.session.catalogue import hair_colors as hair_colors
    from tts2face.session.catalogue import haircuts as haircuts
    from tts2face.session.catalogue import identities as identities
    from tts2face.session.catalogue import languages as languages
    from tts2face.session.catalogue import styles as styles
    from tts2face.session.catalogue import talkers as talkers
    from tts2face.session.catalogue import voices as voices
    from tts2face.session.clip_files import convert as convert
    from tts2face.session.clip_files import export as export
    from tts2face.session.clip_files import load_clip as load_clip
    from tts2face.session.clip_files import write_clip as write_clip
    from tts2face.session.inspection import FileMarks as FileMarks
    from tts2face.session.inspection import inspect_file as inspect_file
    from tts2face.session.live.frames import Frame as Frame
    from tts2face.session.live.frames import LiveEvent as LiveEvent
    from tts2face.session.live.stream import FaceStream as FaceStream
    from tts2face.session.outputs import WrittenClip as WrittenClip
    from tts2face.session.performance import Performance as Performance
    from tts2face.session.project import Project as Project
    from tts2face.session.project_file import load_project as load_project
    from tts2face.session.project_file import save_project as save_project
    from tts2face.session.session import Session as Session
    from tts2face.session.speech_stream import Piece as Piece
    from tts2face.storage.signing import Credentials as Credentials
    from tts2face.types import Chunk as Chunk
    from tts2face.types import Clip as Clip
    from tts2face.types import Speech as Speech
    from tts2face.types import Trajectory as Trajectory
    from tts2face.types import Waveform as Waveform


__version__ = "0.2.0"

__all__ = [
    "AnimatedFace",
    "BackendError",
    "BatchOptions",
    "BatchResult",
    "Cast",
    "Chunk",
    "Clip",
    "Credentials",
    "Cue",
    "DataError",
    "Face",
    "FaceStream",
    "FileMarks",
    "Frame",
    "FromPhones",
    "FromSound",
    "Idle",
    "ImportReport",
    "ImportedFace",
    "InputError",
    "Listening",
    "LiveEvent",
    "Palette",
    "Performance",
    "PhoneSequence",
    "Picture",
    "Piece",
    "Plan",
    "Project",
    "Recorded",
    "Request",
    "Session",
    "Speech",
    "Spoken",
    "SubtitleOptions",
    "Subtitles",
    "Talker",
    "Trajectory",
    "Tts2faceError",
    "Waveform",
    "WordSpan",
    "WrittenCharacter",
    "WrittenClip",
    "convert",
    "export",
    "face_from_photo",
    "faces",
    "formats",
    "hair_colors",
    "haircuts",
    "identities",
    "import_face",
    "inspect_file",
    "languages",
    "load_clip",
    "load_face",
    "load_palette",
    "load_project",
    "load_talker",
    "measure_plan",
    "plan_batch",
    "read_cast",
    "read_subtitles",
    "run_batch",
    "save_face",
    "save_project",
    "styles",
    "talkers",
    "voices",
    "write_character",
    "write_clip",
]

_MODULES = {
    "lexicon.errors": ("BackendError", "DataError", "InputError", "Tts2faceError"),
    "lexicon.sequence": ("PhoneSequence", "WordSpan"),
    "tts2face.session.clip_files": ("convert", "export", "load_clip", "write_clip"),
    "tts2face.serving.batch.cast": ("Cast", "read_cast"),
    "tts2face.serving.batch.options": ("BatchOptions",),
    "tts2face.serving.batch.output": ("Plan",),
    "tts2face.serving.batch.plan": ("plan_batch",),
    "tts2face.serving.batch.report": ("measure_plan",),
    "tts2face.serving.batch.run": ("BatchResult", "run_batch"),
    "tts2face.session.catalogue": (
        "faces",
        "formats",
        "hair_colors",
        "haircuts",
        "identities",
        "languages",
        "styles",
        "talkers",
        "voices",
    ),
    "tts2face.interchange.characters.animation": ("WrittenCharacter", "write_character"),
    "tts2face.interchange.characters.importing": ("ImportReport", "ImportedFace", "import_face"),
    "tts2face.interchange.characters.saving": ("save_face",),
    "tts2face.models.face": ("Face",),
    "tts2face.models.face_loading": ("load_face",),
    "tts2face.models.palette": ("Palette",),
    "tts2face.models.palette_file": ("load_palette",),
    "tts2face.models.talker": ("Talker",),
    "tts2face.models.talker_file": ("load_talker",),
    "tts2face.photo.face_from_photo": ("face_from_photo",),
    "tts2face.session.project": ("Project",),
    "tts2face.session.project_file": ("load_project", "save_project"),
    "tts2face.picture.options": ("Picture",),
    "tts2face.request": ("FromPhones", "FromSound", "Idle", "Listening", "Recorded", "Request", "Spoken"),
    "tts2face.session.inspection": ("FileMarks", "inspect_file"),
    "tts2face.session.session": ("Session",),
    "tts2face.storage.signing": ("Credentials",),
    "tts2face.session.animated_face": ("AnimatedFace",),
    "tts2face.interchange.subtitles.cues": ("Cue", "Subtitles"),
    "tts2face.interchange.subtitles.options": ("SubtitleOptions",),
    "tts2face.interchange.subtitles.reader": ("read_subtitles",),
    "tts2face.session.speech_stream": ("Piece",),
    "tts2face.session.live.frames": ("Frame", "LiveEvent"),
    "tts2face.session.live.stream": ("FaceStream",),
    "tts2face.session.performance": ("Performance",),
    "tts2face.session.outputs": ("WrittenClip",),
    "tts2face.types": ("Chunk", "Clip", "Speech", "Trajectory", "Waveform"),
}
_HOMES = {name: module for module, names in _MODULES.items() for name in names}


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module 'tts2face' has no attribute {name!r}")
    value = getattr(import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """Public names, whether imported already or not."""
    return sorted({*globals(), *__all__})
