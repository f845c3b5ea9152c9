"""Texts of a check of an upload: descriptions of limited length, and refusals without paths of this machine."""

from pathlib import Path
from typing import Any

MAX_TEXT = 1000  # characters of a text of the description
MAX_ENTRIES = 200  # identities or styles of the description
UNPACKED = "unpacked"  # folder of a character's files beside its archive


def without_name(entry: dict[str, Any]) -> dict[str, Any]:
    """Entry of a catalogue of a model, without its name."""
    return {key: value for key, value in entry.items() if key != "name"}


def bounded(value: Any) -> Any:
    """JSON with texts and lists of limited length: a file chooses what its description says."""
    if isinstance(value, str):
        return value[:MAX_TEXT]
    if isinstance(value, list | tuple):
        return [bounded(item) for item in value[:MAX_ENTRIES]]
    if isinstance(value, dict):
        return {str(key)[:MAX_TEXT]: bounded(item) for key, item in value.items()}
    return value


def of_command(text: str) -> str:
    """Text that says where the options are that it names and uploads do not have."""
    is_named = any(option in text for option in ("--front", "--landmarks"))
    return f"{text} (of the command `tts2face face import`, whose face can be sent)" if is_named else text


def refusal(error: Exception, source: Path, folder: Path, content: Path) -> str:
    """The message of an error in a check of `source`, without paths of this machine; `content` is what is kept."""
    text = " ".join(str(error).split()).replace("--mapping", "the part mapping")
    text = of_command(text.replace("--shapes transfer", "the part shapes, transfer"))
    for suffix in (".tsv", ".toml"):
        text = text.replace(str(source.with_name(f"mapping{suffix}")), "the mapping")
    faces = [folder / f"{made}.face" for made in ("imported", "photo")]
    for path in (source, content, source.with_name("character.glb"), *faces):
        text = text.replace(f"{path}: ", "").replace(str(path), "it")
    unpacked = source.with_name(UNPACKED)
    return text.replace(f"{unpacked}/", "").replace(str(unpacked), "the archive")
