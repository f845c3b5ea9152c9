"""Table of the export formats, which imports no numeric library; the suffix of a path selects a format.

Formats of other packages (docs/plugins.md) are asked for where none of the table fits.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError, InputError
from tts2face.plugins import EXPORTS, declared, load_plugin
from tts2face.storage.output_paths import MOVIE_SUFFIXES

JSON_LINES = "application/jsonl"


@dataclass(frozen=True, slots=True)
class FormatInfo:
    """An export format.

    Parameters
    ----------
    name
        Name of the format, for ``FORMAT:PATH``.
    suffixes
        Endings of file names that select it, in lower case; the longest that fits a name wins.
    summary
        What the file holds.
    writer
        Class of its writer, a `tts2face.interchange.exports.parts.FormatWriter`; of the formats of the table its
        module beside this one, and its name.
    has_frames
        Whether it holds values for each frame, so that a frame rate can be chosen.
    default_fps
        Frame rate unless one is given; None for that of the clip.
    uses_shapes, needs_mesh
        Whether it expresses the channels by ARKit shapes, and whether it holds the mesh of the face.
    has_sound_beside
        Whether the sound is written to a .wav file beside it.
    has_lines, media_type
        Whether it consists of lines of text that can be sent while they are made, and their type over HTTP.
    package
        Package that it needs besides those of tts2face.
    is_clip, is_sound
        Whether it holds the whole clip as it is, and whether it holds nothing but the sound.
    """

    name: str
    suffixes: tuple[str, ...]
    summary: str
    writer: tuple[str, str] | Callable[[Any], Any]
    has_frames: bool = False
    default_fps: float | None = None
    uses_shapes: bool = False
    needs_mesh: bool = False
    has_sound_beside: bool = False
    has_lines: bool = False
    media_type: str = JSON_LINES
    package: str | None = None
    is_clip: bool = False
    is_sound: bool = False

    @property
    def has_motion(self) -> bool:
        """Whether it holds motion of the face or head."""
        return self.has_frames or self.is_clip

    @property
    def uses_face(self) -> bool:
        """Whether its writer takes the mesh of the face."""
        return self.uses_shapes or self.needs_mesh

    @property
    def is_installed(self) -> bool:
        """Whether the package that it needs is installed."""
        return self.package is None or find_spec(self.package) is not None

    def make_writer(self) -> Callable[[Any], Any]:
        """The class of its writer, imported."""
        if callable(self.writer):
            return self.writer
        module, name = self.writer
        factory: Callable[[Any], Any] = getattr(import_module(f"tts2face.interchange.exports.{module}"), name)
        return factory


LIVELINK_FPS = 60.0  # of the Live Link Face app

FORMATS = (
    FormatInfo("track", (".track.json", ".json"), "lossless clip: motion, head, phones, words, sound",
               ("track", "TrackWriter"), is_clip=True),
    FormatInfo("livelink", (".csv",), "ARKit-52 weights and head angles, as Live Link Face records them",
               ("livelink", "LiveLinkWriter"), has_frames=True, default_fps=LIVELINK_FPS, uses_shapes=True,
               has_lines=True, media_type="text/csv"),
    FormatInfo("a2f", (".a2f.json",), "ARKit-52 weights as Audio2Face exports them",
               ("audio2face", "Audio2FaceWriter"), has_frames=True, uses_shapes=True),
    FormatInfo("glb", (".glb",), "mesh, morph targets, skeleton and animation (glTF 2.0)",
               ("character_glb", "make_glb_writer"), has_frames=True, needs_mesh=True, has_sound_beside=True),
    FormatInfo("vrma", (".vrma",), "expressions, head and gaze for VRM avatars (VRM Animation 1.0)",
               ("vrma", "VrmaWriter"), has_frames=True, uses_shapes=True, has_sound_beside=True),
    FormatInfo("usd", (".usda", ".usdc", ".usd", ".usdz"), "mesh, shapes, materials, skeleton and animation (UsdSkel)",
               ("usd", "UsdWriter"), has_frames=True, needs_mesh=True, has_sound_beside=True, package="pxr"),
    FormatInfo("bvh", (".bvh",), "head motion", ("bvh", "BvhWriter"), has_frames=True),
    FormatInfo("npz", (".npz",), "all arrays for NumPy", ("npz", "NpzWriter"), has_frames=True),
    FormatInfo("oculus", (".oculus.jsonl",), "15 visemes of Oculus Lipsync, JSON lines",
               ("viseme_lines", "OculusWriter"), has_lines=True),
    FormatInfo("azure", (".azure.jsonl",), "22 viseme ids of Azure Speech, JSON lines",
               ("viseme_lines", "AzureWriter"), has_lines=True),
    FormatInfo("curves", (".curves.jsonl",), "ARKit-52 weights and head pose of each frame, JSON lines",
               ("curve_lines", "CurveLinesWriter"), has_frames=True, uses_shapes=True, has_lines=True),
    FormatInfo("rhubarb-json", (".rhubarb.json",), "mouth cues A-H and X of Rhubarb Lip Sync",
               ("rhubarb", "RhubarbJsonWriter")),
    FormatInfo("rhubarb-tsv", (".rhubarb.tsv",), "the same as a table", ("rhubarb", "RhubarbTsvWriter")),
    FormatInfo("rhubarb-xml", (".rhubarb.xml",), "the same as XML", ("rhubarb", "RhubarbXmlWriter")),
    FormatInfo("words", (".words.jsonl",), "words with their times and confidence, JSON lines",
               ("word_lines", "WordLinesWriter"), has_lines=True),
    FormatInfo("textgrid", (".textgrid",), "words and phones for Praat", ("textgrid", "TextGridWriter")),
    FormatInfo("vtt", (".vtt",), "WebVTT captions, one cue for each sentence", ("captions", "SentenceVttWriter")),
    FormatInfo("srt", (".srt",), "SubRip captions, one cue for each sentence", ("captions", "SentenceSrtWriter")),
    FormatInfo("words-vtt", (".words.vtt",), "WebVTT, one cue for each word", ("captions", "WordVttWriter")),
    FormatInfo("words-srt", (".words.srt",), "SubRip, one cue for each word", ("captions", "WordSrtWriter")),
    FormatInfo("karaoke-vtt", (".karaoke.vtt",), "WebVTT sentences with a time before each word",
               ("captions", "KaraokeVttWriter")),
    FormatInfo("wav", (".wav",), "the sound, 16-bit PCM", ("sound", "WavWriter"), is_sound=True),
)  # fmt: skip
_BY_NAME = {info.name: info for info in FORMATS}
_BY_SUFFIX = {suffix: info for info in FORMATS for suffix in info.suffixes}
_NAME = re.compile(r"[a-z0-9][a-z0-9-]+")  # of a format before a colon; a single letter is a drive


def all_formats() -> tuple[FormatInfo, ...]:
    """The formats of the table and of other packages; one that cannot be loaded says so, and is not installed."""
    return (*FORMATS, *(_listed(name) for name in declared(EXPORTS) if name not in _BY_NAME))


def _listed(name: str) -> FormatInfo:
    try:
        return _by_name(name)
    # a damaged plug-in is listed with its reason, and the other formats work
    except BackendError as broken:
        return FormatInfo(name, (), str(broken), ("", ""), package="a package that cannot be loaded")


def _by_name(name: str) -> FormatInfo:
    """Format of a name that exists; errors as `load_plugin`."""
    if name in _BY_NAME:
        return _BY_NAME[name]
    info: FormatInfo = load_plugin(EXPORTS, name)
    return info


def _is_name(name: str) -> bool:
    return name in _BY_NAME or (_NAME.fullmatch(name) is not None and name in declared(EXPORTS))


def _by_suffix(name: str) -> dict[str, FormatInfo]:
    """Formats by their suffixes: those of other packages, too, for a name with an ending that is none of ours."""
    # other packages are asked only for endings that are none of ours
    if "." not in name or name.lower().endswith((*_BY_SUFFIX, *MOVIE_SUFFIXES)):
        return _BY_SUFFIX
    return {suffix: info for info in reversed(all_formats()) for suffix in info.suffixes}


def split_format(given: str | Path) -> tuple[Path, str | None]:
    """Path and format of ``FORMAT:PATH``; None without one of the names of `FORMATS` before the colon."""
    if isinstance(given, str):
        name, colon, rest = given.partition(":")
        if colon and _is_name(name):
            return Path(rest), name
    return Path(given), None


def is_export(path: str | Path) -> bool:
    """Whether the ending of a file name selects an export format."""
    return _longest_suffix(Path(path).name) is not None


def find_format(path: Path, name: str | None = None) -> FormatInfo:
    """Format of a name, or of the ending of a path.

    Raises
    ------
    InputError
        There is no such format, or several share the last suffix.
    """
    if name is not None:
        if not _is_name(name):
            names = ", ".join(info.name for info in all_formats())
            raise InputError(f"there is no export format {name!r}; choose one of {names}")
        return _by_name(name)
    known, suffix = _by_suffix(path.name), _longest_suffix(path.name)
    if suffix is not None:
        return known[suffix]
    endings, last = [ending for info in all_formats() for ending in info.suffixes], path.suffix.lower()
    several = [ending for ending in endings if last and ending.endswith(last)]
    if several:
        raise InputError(f"{path.name} may have several formats; end its name in {_choices(several)}")
    raise InputError(f"{path.name} has no suffix of an export format; end its name in {_choices(endings)}")


def batch_format(name: str) -> tuple[str, FormatInfo]:
    """Ending and format of the files of a batch, by a suffix with or without its point, or by the name of a format.

    Raises
    ------
    InputError
        There is no such format.
    """
    suffix = f".{name.lower().removeprefix('.')}"
    known = _by_suffix(suffix)
    if suffix in known:
        return suffix, known[suffix]
    if _is_name(name):
        return _by_name(name).suffixes[0], _by_name(name)
    raise InputError(
        f"there is no export format {name!r}; give an ending ({_choices([info[1:] for info in known])}) or a name "
        "that `tts2face formats` lists"
    )


def sound_name(name: str) -> str:
    """Name of the sound file beside an export: its own name with another ending."""
    suffix = _longest_suffix(name)
    return f"{name[: -len(suffix)] if suffix else name.partition('.')[0]}.wav"


def _choices(suffixes: Sequence[str]) -> str:
    return " or ".join(filter(None, [", ".join(suffixes[:-1]), suffixes[-1]]))


def _longest_suffix(name: str) -> str | None:
    fitting = [suffix for suffix in _by_suffix(name) if name.lower().endswith(suffix)]
    return max(fitting, key=len, default=None)
