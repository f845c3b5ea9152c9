"""Voices, export formats and tools of other packages, by their entry points (docs/plugins.md)."""

from functools import cache
from typing import TYPE_CHECKING, Any

from lexicon.errors import BackendError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

VOICES, EXPORTS, TOOLS = "tts2face.voices", "tts2face.exports", "tts2face.tools"  # groups of entry points


@cache
def declared(group: str) -> "dict[str, EntryPoint]":
    """What the installed packages declare in a group, by name, in the order of names."""
    from importlib.metadata import entry_points  # names that are shipped need none

    return {one.name: one for one in sorted(entry_points(group=group), key=lambda one: one.name)}


def load_plugin(group: str, name: str) -> Any:
    """What a package declares under a name of `declared`.

    Raises
    ------
    BackendError
        It cannot be imported; others can.
    """
    one = declared(group)[name]
    try:
        return one.load()
    except Exception as broken:  # whatever a stranger's module raises
        package = one.dist.name if one.dist is not None else one.value
        kind = group.rpartition(".")[2].removesuffix("s")
        raise BackendError(
            f"the {kind} {name} of the package {package} cannot be loaded ({type(broken).__name__}: {broken}); update "
            "the package, or uninstall it"
        ) from broken
