"""What a child process runs: handlers of ours, or a tool of a package above this one or of a stranger."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from importlib import import_module
from typing import Any

from lexicon.errors import BackendError
from lexicon.inputs import parse_json
from tts2face.plugins import TOOLS, declared, load_plugin
from tts2face.processes.limits import ProcessLimits, bare_environment, child_environment


@dataclass(frozen=True, slots=True)
class Program:
    """Handlers and limits of a child.

    Parameters
    ----------
    handlers
        ``module:NAME`` of a table of handlers, or of a function that makes one of `settings`; or the name of an entry
        point of the group `TOOLS`, one handler or a table of them.
    limits
        For files of strangers; with them it gets no credentials of the environment. None: no limits.
    core
        Core to which it is bound; None: all.
    niceness
        Added to that of the parent; streams of a server go first.
    at_once
        Calls that an `AsyncChild` answers at once, each in a thread of its own; a caller who leaves one ends that
        call and not the process.
    settings
        JSON values.
    has_log
        Its standard error is that of the parent, for a log; otherwise its last line says why the child ended.
    """

    handlers: str
    limits: ProcessLimits | None = None
    core: int | None = None
    niceness: int = 0
    at_once: int = 1
    settings: Mapping[str, Any] = field(default_factory=dict)
    has_log: bool = False

    def written(self) -> str:
        """The argument of the child's command line."""
        return json.dumps(asdict(self))

    def environment(self) -> dict[str, str]:
        """Variables of the child."""
        return child_environment(self.core) if self.limits is None else bare_environment()

    def load(self) -> Mapping[str, Any]:
        """The handlers by name.

        Raises
        ------
        BackendError
            No installed package declares the tool, or it cannot be loaded.
        """
        module, _, name = self.handlers.partition(":")
        if name:
            handlers: Any = getattr(import_module(module), name)
            return handlers(**self.settings) if callable(handlers) else handlers  # type: ignore[no-any-return]
        if module not in declared(TOOLS):
            raise BackendError(f"no installed package declares the tool {module!r} ({TOOLS}); install tts2face again")
        tool = load_plugin(TOOLS, module)
        return tool if isinstance(tool, Mapping) else {module: tool}


def read_program(argument: str) -> Program:
    """The program of `Program.written`."""
    content = parse_json(argument, "the program of a child process")
    limits = None if content["limits"] is None else ProcessLimits(**content["limits"])
    return Program(**content | {"limits": limits})
