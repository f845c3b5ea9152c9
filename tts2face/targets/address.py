"""Addresses of targets: a kind, a place, and options behind ``#``, which are not sent to the place.

They come from the command line, from programs and from the operator's settings: never from a client, which would choose
where a face is shown.
"""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from urllib.parse import SplitResult, urlsplit

from lexicon.errors import DataError, InputError
from lexicon.values.files import read_text

TOKEN_VARIABLE = "TTS2FACE_LIVE_TOKEN"  # environment variable of the token of servers, where no file is named
MAX_SECRET_BYTES = 10_000  # of a file with a token or a stream key


@dataclass(frozen=True, slots=True)
class Address:
    """Address of a target.

    Parameters
    ----------
    kind
        Its scheme: ``whip``, ``rtmp``, ``vmc``, ...
    host, port
        Empty and 0 where the kind has no place.
    url
        Opened by a client of the place; never shown, as stream keys are parts of it.
    options
        By name; one without a value is empty.
    """

    kind: str
    host: str = ""
    port: int = 0
    url: str = field(default="", repr=False)
    options: Mapping[str, str] = field(default_factory=dict, repr=False)

    @property
    def shown(self) -> str:
        """Kind and place for messages, without path, key and options."""
        if not self.host:
            return self.kind
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"{self.kind}:{host}:{self.port}"

    def secret(self, name: str, variable: str = "") -> str:
        """Content of the file that an option names, or of an environment variable; empty without both.

        A file that cannot be read or has several words is refused (`InputError`).
        """
        if name not in self.options:
            return os.environ.get(variable, "").strip()
        path = Path(self.options[name])
        try:
            secret = read_text(path, MAX_SECRET_BYTES).strip()
        except (OSError, DataError) as refused:
            why = refused.strerror if isinstance(refused, OSError) else "it is no short text"
            raise InputError(f"the file {path} with the {name} of {self.shown} cannot be read: {why}") from refused
        if not secret or any(map(str.isspace, secret)):
            raise InputError(f"the file {path} must hold the {name} of {self.shown} alone, in one line")
        return secret


def split_place(place: str, example: str) -> SplitResult:
    """Parts of a URL, or of ``//HOST:PORT``.

    One without a host, with a wrong port, or with a password, which lists of processes would show, is refused
    (`InputError`).
    """
    try:
        parts = urlsplit(place)
        if parts.port == 0:
            raise ValueError("port 0 is none")
    except ValueError as wrong:
        raise InputError(f"{_hidden(place)!r} is no address of a target ({wrong}); give one as {example}") from wrong
    if parts.username is not None or parts.password is not None:
        raise InputError(f"the address of a target holds no password; give one as {example}")
    if not parts.hostname:
        raise InputError(f"{_hidden(place)!r} names no host; give an address as {example}")
    return parts


def parse_options(text: str, known: Mapping[str, bool], shown: str) -> Mapping[str, str]:
    """Options behind ``#``, separated by commas.

    One that is unknown, stands there twice, lacks its value or has one that it does not take is refused (`InputError`).

    Parameters
    ----------
    known
        Names of the options of the kind, and whether each has a value.
    """
    found: dict[str, str] = {}
    for part in filter(None, text.split(",")):
        name, equals, value = part.partition("=")
        if name not in known:
            choice = f"; its options are {', '.join(known)}" if known else ", which has none"
            raise InputError(f"there is no option {name[:40]!r} of {shown}{choice}")
        if name in found or bool(value) != known[name] or bool(equals) != known[name]:
            form = f"{name}=VALUE" if known[name] else f"{name}, without a value"
            raise InputError(f"the option {name} of {shown} must stand there once, as {form}")
        found[name] = value
    return MappingProxyType(found)


def _hidden(place: str) -> str:
    """The beginning of an address for messages: what follows the host may be a key."""
    scheme, slashes, rest = place.partition("//") if "//" in place else ("", "", place)
    host = rest.partition("/")[0].rpartition("@")[2]
    return f"{scheme}{slashes}{host}"[:60] if scheme else host[:60]
