"""The cast file: which speaker of the subtitles has which talker, voice, face, identity, palette and gestures.

::

    [default]
    face = "head"

    [[role]]
    speaker = "ANN*"         # a pattern of shells; also `subtitle_style`, `file` and `text`
    identity = "kofi"
    voice = "espeak-female"
    style = "delighted"

    [[role]]
    subtitle_style = "Sign*"
    silent = true            # signs and credits are left out
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, fields
from fnmatch import fnmatchcase
from pathlib import Path
from types import MappingProxyType
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.checks import check_type, format_value
from lexicon.values.fields import check_fields
from lexicon.values.files import is_file, read_text
from lexicon.values.toml_text import parse_toml
from tts2face.interchange.subtitles.cues import Cue
from tts2face.request import OPTIONS, Request
from tts2face.session.named_models import Models
from tts2face.sound.voice_urls import refuse_voice_url

MODEL_NAMES = tuple(option.name for option in fields(Models))
PATTERN_NAMES = ("speaker", "subtitle_style", "file", "text")
SILENT = "silent"  # setting of cues that are left out
NOT_IN_CAST: Mapping[str, str] = MappingProxyType({  # options, with the reason
    "text": "the cues have it", "audio": "that of the file", "audio_map": "the words are given", "idle": "cues speak",
    "listen": "cues speak", "partner": "cues speak",
    "fps": "one of all clips", "timeline": "its times are those of one clip",
    "expression": "its times are those of one clip", "lead": "the cues have their time",
})  # fmt: skip
REQUEST_NAMES = tuple(name for name in OPTIONS if name not in NOT_IN_CAST)
PATH_NAMES = ("talker", "face", "palette", "voice", "dictionary", "text_marks")
MAX_CAST_BYTES = 1_000_000


@dataclass(frozen=True, slots=True)
class Role:
    """Patterns of the cues to which a role applies, and its settings."""

    patterns: Mapping[str, str]
    settings: Mapping[str, Any]

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)

    def applies(self, cue: Cue, file: str) -> bool:
        """Whether all patterns match a cue, in capitals and small letters alike."""
        values = {"speaker": cue.speaker, "subtitle_style": cue.style, "file": file, "text": cue.text}
        return all(fnmatchcase(values[name].lower(), pattern.lower()) for name, pattern in self.patterns.items())


@dataclass(frozen=True, slots=True)
class Cast:
    """Settings of all cues, and roles; the first role that applies to a cue counts."""

    default: Mapping[str, Any] = field(default_factory=dict)
    roles: tuple[Role, ...] = ()

    def __post_init__(self) -> None:
        """Refuse values of other types (`InputError`)."""
        check_fields(self)

    def role_of(self, cue: Cue, file: str) -> Role | None:
        """The first role that applies to a cue."""
        return next((role for role in self.roles if role.applies(cue, file)), None)

    def unused(self, used: Collection[int]) -> list[str]:
        """Warnings of roles that apply to no cue; `used` holds the identities of the others."""
        return [
            f"role {number} ({', '.join(f'{name} {pattern!r}' for name, pattern in role.patterns.items())}) applies to "
            "no cue; check its patterns"
            for number, role in enumerate(self.roles, start=1)
            if id(role) not in used
        ]

    def settings(self, cue: Cue, file: str) -> dict[str, Any]:
        """Settings of a cue by name: those of its role over the defaults."""
        role = self.role_of(cue, file)
        return {**self.default, **(role.settings if role else {})}

    def is_silent(self, cue: Cue, file: str) -> bool:
        """Whether a cue is left out."""
        return bool(self.settings(cue, file).get(SILENT, False))


def read_cast(path: Path) -> Cast:
    """Cast of a TOML file; paths in it are relative to its folder.

    Raises
    ------
    InputError
        There is no such file.
    DataError
        It is not TOML, or has an unknown table, key or value; the message names it.
    """
    try:
        content = read_text(path, MAX_CAST_BYTES)
    except OSError as refused:
        raise InputError(f"cannot read the cast {path}: {refused.strerror}; check the path") from refused
    return cast_from_tables(parse_toml(content, str(path)), str(path), path.parent)


def cast_from_tables(tables: Mapping[str, Any], place: str, folder: Path | None = None) -> Cast:
    """Cast of the tables of a TOML file; its paths are relative to a folder, without one nothing is a path.

    Raises
    ------
    DataError
        There is an unknown table, key or value; the message names it.
    """
    for name in tables:
        if name not in ("default", "role"):
            raise DataError(f"{place}: there is no table {name!r}; use [default] and [[role]]")
    roles, default = tables.get("role", []), tables.get("default", {})
    if (
        not isinstance(roles, list)
        or not isinstance(default, dict)
        or not all(isinstance(role, dict) for role in roles)
    ):
        raise DataError(f"{place}: write the defaults as [default], and each role as [[role]]")
    return Cast(
        _settings(default, f"{place}, [default]", folder),
        tuple(_role(role, f"{place}, role {number}", folder) for number, role in enumerate(roles, start=1)),
    )


def _role(table: Mapping[str, Any], place: str, folder: Path | None) -> Role:
    patterns = {name: table[name] for name in PATTERN_NAMES if name in table}
    if not patterns:
        raise DataError(f"{place} has no pattern; give {', '.join(PATTERN_NAMES)}")
    for name, pattern in patterns.items():
        try:
            check_type(name, pattern, str)
        except InputError as wrong:
            raise DataError(f"{place}: {wrong}") from wrong
    rest = {name: value for name, value in table.items() if name not in PATTERN_NAMES}
    return Role(patterns, _settings(rest, place, folder))


def _settings(table: Mapping[str, Any], place: str, folder: Path | None) -> dict[str, Any]:
    for name, value in table.items():
        if name == SILENT and not isinstance(value, bool):
            raise DataError(f"{place}: silent must be true or false, not {format_value(value)}")
        if name not in (SILENT, *MODEL_NAMES, *REQUEST_NAMES):
            known = ", ".join((*PATTERN_NAMES, SILENT, *MODEL_NAMES, *REQUEST_NAMES))
            raise DataError(f"{place}: there is no setting {name!r}; use {known}")
        if value is None:
            raise DataError(f"{place}: {name} must be a text, a number or true or false, not {format_value(value)}")
    refuse_voice_url(table.get("voice"), place)
    settings = {name: _resolve(name, value, folder) for name, value in table.items()}
    try:
        Request(**{name: value for name, value in settings.items() if name in REQUEST_NAMES})
        Models(**{name: value for name, value in settings.items() if name in MODEL_NAMES})
    except InputError as wrong:
        raise DataError(f"{place}: {wrong}") from wrong
    return settings


def _resolve(name: str, value: Any, folder: Path | None) -> Any:
    """A path relative to the folder of the cast, where there is such a file; else the value."""
    if folder is None:
        return value
    if name in PATH_NAMES and isinstance(value, str) and Path(value).suffix and is_file(folder / value):
        return str(folder / value)
    return value
