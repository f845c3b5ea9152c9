"""Lists of the available voices, languages, faces, identity presets, haircuts, styles, talkers and export formats."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from lexicon.errors import BackendError, DataError
from tts2face.models.person import SHIPPED_PEOPLE, person_of
from tts2face.request import OWN_FACE, REALISTIC_FACE
from tts2face.storage.shipped import SHIPPED_FOLDER, find_file

SHORT_S = 120.0  # recordings that are shorter are listed in seconds


@dataclass(frozen=True, slots=True)
class VoiceEntry:
    """A voice.

    ``name`` is a value of ``Request.voice``; for Piper voices it is a placeholder for the path of a file.
    ``languages`` are espeak-ng codes; they are empty for Piper voices, whose settings files name the language.
    """

    name: str
    engine: str
    languages: tuple[str, ...]
    is_installed: bool
    summary: str
    sex: str
    licence: str


@dataclass(frozen=True, slots=True)
class LanguageEntry:
    """A language of espeak-ng: its code and its English name."""

    code: str
    name: str


@dataclass(frozen=True, slots=True)
class FaceEntry:
    """A face, the names of its identity presets, whether haircuts fit it, and sex and age of the person, if known."""

    name: str
    identities: tuple[str, ...]
    summary: str
    takes_haircuts: bool = False
    person: str = ""


@dataclass(frozen=True, slots=True)
class IdentityEntry:
    """A preset of a face's age, sex and ancestry; ``person`` as of a face."""

    name: str
    face: str
    summary: str
    person: str = ""


@dataclass(frozen=True, slots=True)
class HaircutEntry:
    """A haircut of a shipped face."""

    name: str
    face: str
    summary: str


@dataclass(frozen=True, slots=True)
class HairColorEntry:
    """A hair colour, sRGB as #rrggbb."""

    name: str
    color: str


@dataclass(frozen=True, slots=True)
class StyleEntry:
    """A style of a palette; ``source`` is the recorded style that it is derived from, None for a recorded style."""

    name: str
    palette: str
    source: str | None
    summary: str


@dataclass(frozen=True, slots=True)
class TalkerEntry:
    """A talker: the amount of recorded speech, and whether the talker's own face can be drawn (``--face self``)."""

    name: str
    language: str
    licence: str
    n_utterances: int
    minutes: float
    has_own_face: bool


@dataclass(frozen=True, slots=True)
class FormatEntry:
    """An export format: name, suffixes of its files, whether its package is installed, and what it holds."""

    name: str
    suffixes: tuple[str, ...]
    is_installed: bool
    summary: str


def formats() -> tuple[FormatEntry, ...]:
    """The formats of `tts2face.export`."""
    from tts2face.interchange.exports.table import all_formats

    return tuple(FormatEntry(info.name, info.suffixes, info.is_installed, info.summary) for info in all_formats())


def voices() -> tuple[VoiceEntry, ...]:
    """All voices, whether their packages are installed, and their languages.

    Raises
    ------
    BackendError
        espeak-ng is not installed or does not start.
    """
    from tts2face.sound.voice_pool import voice_names

    codes = tuple(language.code for language in languages())
    return (
        *(_voice_entry(name, codes) for name in voice_names()),
        VoiceEntry(
            "FILE.onnx",
            "piper",
            (),
            _is_installed("onnxruntime"),
            "a Piper voice by its path (extra [piper] for other languages than English)",
            "-",
            "see its model card",
        ),
    )


def _voice_entry(name: str, codes: tuple[str, ...]) -> VoiceEntry:
    """Entry of a voice; one whose package cannot be loaded says so, and is not installed."""
    from tts2face.sound.voice_pool import find_voice, is_installed

    try:
        voice = find_voice(name)
    except BackendError as broken:
        return VoiceEntry(name, "-", (), False, str(broken), "-", "-")
    spoken = tuple(code for code in codes if not voice.languages or code in voice.languages)
    return VoiceEntry(name, voice.engine, spoken, is_installed(name), voice.summary, voice.sex, voice.licence)


def languages() -> tuple[LanguageEntry, ...]:
    """All languages of espeak-ng, sorted by code.

    Raises
    ------
    BackendError
        espeak-ng is not installed or does not start.
    """
    from lexicon.g2p import languages as spoken

    return tuple(LanguageEntry(code, name) for code, name in sorted(spoken().items()))


def faces() -> tuple[FaceEntry, ...]:
    """The shipped faces and the entry ``self`` for the talker's own face."""
    own = FaceEntry(OWN_FACE, (), "the talker's own face, for talkers learnt with --appearance")
    return (*(describe_face(path) for path in _shipped_files("face")), own)


def describe_face(path: Path) -> FaceEntry:
    """Entry of a ``.face`` file; raises as `load_face`."""
    header = _read(path, "face")
    names = tuple(name for name, _, _ in header["identities"])
    summary = header.get("metadata", {}).get("summary") or f"mesh with {len(header['shape_names'])} shapes"
    person = person_of(header.get("metadata", {}))
    return FaceEntry(path.stem, names, str(summary), bool(header.get("hairdos")), str(person or ""))


def identities(face: str = "head") -> tuple[IdentityEntry, ...]:
    """The identity presets of a face, given by name or as the path of a ``.face`` file.

    Raises
    ------
    InputError
        The face does not exist.
    DataError
        The file is damaged or is not a ``.face`` file.
    """
    path = find_file(face, "face")
    header = _read(path, "face")
    try:
        return tuple(
            IdentityEntry(name, face, summary, str(SHIPPED_PEOPLE.get((face, name), "")))
            for name, _, summary in header["identities"]
        )
    except (KeyError, TypeError, ValueError) as broken:
        raise DataError(f"{path} lacks its list of identities; build or copy it again") from broken


@cache
def haircuts() -> tuple[HaircutEntry, ...]:
    """The shipped haircuts by their faces: of the head, with ``bald``, and of each drawn character, its own first."""
    from tts2face.models.face_names import BALD, HAIR_KIND, OF_FACE

    found = [HaircutEntry(BALD, REALISTIC_FACE, "no hair")]
    for path in _shipped_files("face"):
        if path.stem != REALISTIC_FACE:
            hairdos = _read(path, "face").get("hairdos", {})
            found += [HaircutEntry(name, path.stem, "the face's own") for name, _ in hairdos.values()]
    for path in _shipped_files(HAIR_KIND):
        face, _, name = path.stem.rpartition(OF_FACE)
        summary = str(_read(path, HAIR_KIND)["metadata"].get("summary", ""))
        found.append(HaircutEntry(name, face or REALISTIC_FACE, summary))
    order = [REALISTIC_FACE, *(path.stem for path in _shipped_files("face"))]
    return tuple(sorted(found, key=lambda entry: order.index(entry.face)))


def haircuts_of(face: str) -> tuple[HaircutEntry, ...]:
    """The haircuts of a face; of one that is not shipped, those of the head."""
    own = tuple(haircut for haircut in haircuts() if haircut.face == face)
    return own or haircuts_of(REALISTIC_FACE)


def hair_colors() -> tuple[HairColorEntry, ...]:
    """The hair colours that have a name."""
    from tts2face.models.named_colours import HAIR_COLOURS

    return tuple(HairColorEntry(name, f"#{digits}") for name, digits in HAIR_COLOURS.items())


def styles(palette: str = "starter") -> tuple[StyleEntry, ...]:
    """The styles of a palette, given by name or as the path of a ``.palette`` file; raises as `load_palette`."""
    from tts2face.models.palette import MEASURED_STYLE
    from tts2face.models.palette_file import load_palette

    found = load_palette(palette)
    derived = (
        StyleEntry(
            name, palette, derivation.source, derivation.summary.removeprefix(f"derived from {derivation.source}: ")
        )
        for name, derivation in found.derivations.items()
    )
    recorded = (
        StyleEntry(name, palette, None, f"recorded, {_length(style.seconds)}") for name, style in found.styles.items()
    )
    listed = (*derived, *recorded)
    if any(entry.name == MEASURED_STYLE for entry in listed):
        return listed
    source = found.source(MEASURED_STYLE)
    summary = f"{source} as recorded: the person's own blinks and head motion"
    return (*listed, StyleEntry(MEASURED_STYLE, palette, source, summary))


def _length(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < SHORT_S else f"{seconds / 60:.1f} minutes"


def talkers() -> tuple[TalkerEntry, ...]:
    """The shipped talkers."""
    return tuple(describe_talker(path) for path in _shipped_files("talker"))


def describe_talker(path: Path) -> TalkerEntry:
    """Entry of a ``.talker`` file; raises as `read_talker`."""
    from tts2face.models.talker_file import read_talker

    talker = read_talker(path)
    seconds = sum(len(utterance.shape) for utterance in talker.utterances) / talker.fps
    return TalkerEntry(
        path.stem,
        str(talker.metadata.get("language", "not stated")),
        str(talker.metadata.get("licence", "not stated")),
        len(talker.utterances),
        round(seconds / 60, 1),
        talker.appearance is not None,
    )


def shipped_names(kind: str) -> tuple[str, ...]:
    """Names of the shipped files of a kind (talker, face, palette), without reading them."""
    return tuple(path.stem for path in _shipped_files(kind))


def _shipped_files(kind: str) -> list[Path]:
    return sorted(SHIPPED_FOLDER.glob(f"*.{kind}"))


def _read(path: Path, kind: str) -> Mapping[str, Any]:
    from tts2face.models.face_file import FORMAT_VERSION
    from tts2face.storage.tensors import read_metadata

    return read_metadata(path, kind, FORMAT_VERSION)


def _is_installed(module: str) -> bool:
    return find_spec(module) is not None
