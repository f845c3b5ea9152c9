"""Voices, export formats and tools of other packages, by their entry points (docs/plugins.md)."""

from functools import cache
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

VOICES = "tts2face.voices"  # groups of entry points
EXPORTS = "tts2face.exports"
TOOLS = "tts2face.tools"


@cache
def declared(group: str) -> "dict[str, EntryPoint]":
    """Entry points that the installed packages declare in a group, by name, in the order of names."""
    from importlib.metadata import entry_points  # names that are shipped need none

    return {entry.name: entry for entry in sorted(entry_points(group=group), key=lambda entry: entry.name)}


def load_plugin(group: str, name: str) -> Any:
    """The object that a package declares under a name of `declared`.

    Raises
    ------
    BackendError
        It cannot be imported; others can.
    """
    entry = declared(group)[name]
    try:
        return entry.load()
    except Exception as broken:  # whatever a stranger's module raises
        package = entry.dist.name if entry.dist is not None else entry.value
        kind = group.rpartition(".")[2].removesuffix("s")
        raise BackendError(
            f"the {kind} {name} of the package {package} cannot be loaded ({type(broken).__name__}: {broken}); update "
            "the package, or uninstall it"
        ) from broken
