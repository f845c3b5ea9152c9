"""Kinds of targets: what each is named, shows and takes."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from importlib.util import find_spec
from types import MappingProxyType
from typing import TYPE_CHECKING
from urllib.parse import urlunsplit

from lexicon.errors import BackendError, InputError
from tts2face.targets.address import Address, parse_options, split_place

if TYPE_CHECKING:  # `--help` and settings need no numeric library
    from tts2face.targets.target import Target
    from tts2face.targets.tick import LiveFormat

SECRETS = {"token", "key"}  # options that name a file
KBPS_LIMITS = (50, 100_000)  # thousands of bits in a second
# options of several kinds
_MOVIE = {"kbps": True}
_TOKEN = {"token": True}
_KEYED = _MOVIE | {"key": True}
_ENCRYPTED = "the same, encrypted"
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,39}")
Parse = Callable[["TargetKind", str], Address]


@dataclass(frozen=True, slots=True)
class TargetKind:
    """One kind.

    Parameters
    ----------
    scheme
        Before the first colon.
    form, shows
        For help texts: an address, and what is sent there.
    target
        ``module:Class`` of this room, which is loaded when the kind is used.
    port
        Where an address names none; 0: it must, or the scheme's own.
    options
        Names of the options behind ``#``, and whether each has a value.
    package
        Of the extra `live`, without which it cannot be reached.
    """

    scheme: str
    form: str
    shows: str
    target: str
    parse: Parse
    port: int = 0
    options: Mapping[str, bool] = field(default_factory=dict)
    package: str = ""

    def load(self) -> "type[Target]":
        """The class of the kind."""
        module, _, name = self.target.partition(":")
        found: type[Target] = getattr(import_module(f"tts2face.targets.{module}"), name)
        return found


def _of_url(kind: TargetKind, place: str) -> Address:
    """``SCHEME://HOST[:PORT]/PATH``."""
    parts = split_place(f"{kind.scheme}:{place}", kind.form)
    return Address(kind.scheme, str(parts.hostname), parts.port or kind.port, urlunsplit(parts))


def _of_web(kind: TargetKind, place: str) -> Address:
    """``SCHEME:http[s]://HOST[:PORT]/PATH``."""
    parts = split_place(place, kind.form)
    ports = {"https": 443, "http": 80}
    if parts.scheme not in ports:
        raise InputError(f"{kind.scheme}: needs a URL of http or https; give one as {kind.form}")
    return Address(kind.scheme, str(parts.hostname), parts.port or ports[parts.scheme], urlunsplit(parts))


def _of_place(kind: TargetKind, place: str) -> Address:
    """``SCHEME:HOST[:PORT]``."""
    parts = split_place(f"//{place}", kind.form)
    if parts.path or parts.query:
        raise InputError(f"{kind.scheme}: needs a host and a port alone; give them as {kind.form}")
    host, port = str(parts.hostname), parts.port or kind.port
    return Address(kind.scheme, host, port, f"ws://{f'[{host}]' if ':' in host else host}:{port}")


def _of_nothing(kind: TargetKind, place: str) -> Address:
    if place:
        raise InputError(f"{kind.scheme} takes no place, not {place[:40]!r}; give {kind.form}")
    return Address(kind.scheme)


TARGETS = (
    TargetKind("whip", "whip:https://HOST/PATH", "pictures and sound by WebRTC (WHIP)", "movie_targets:WhipTarget",
               _of_web, 0, _MOVIE | _TOKEN, "cryptography"),
    TargetKind("rtmp", "rtmp://HOST/APP/KEY", "pictures and sound by RTMP", "movie_targets:RtmpTarget",
               _of_url, 1935, _KEYED),
    TargetKind("rtmps", "rtmps://HOST/APP/KEY", _ENCRYPTED, "movie_targets:RtmpTarget", _of_url, 443, _KEYED),
    TargetKind("rtsp", "rtsp://HOST/PATH", "pictures and sound by RTSP", "movie_targets:RtspTarget",
               _of_url, 554, _MOVIE),
    TargetKind("vmc", "vmc:HOST:39539", "52 weights or five vowels, and the head, for VRM avatars", "vmc:VmcTarget",
               _of_place, 39_539, {"vowels": False}),
    TargetKind("livelink", "livelink:HOST:11111", "52 weights, head and eyes as Live Link Face",
               "livelink:LiveLinkTarget", _of_place, 11_111, {"subject": True}),
    TargetKind("vts", "vts:HOST:8001", "parameters of VTube Studio", "vts:VtsTarget", _of_place, 8001, {"keep": False},
               "websockets"),
    TargetKind("ws", "ws://HOST/PATH", "curves as JSON over a WebSocket", "curve_socket:CurveSocketTarget",
               _of_url, 80, _TOKEN, "websockets"),
    TargetKind("wss", "wss://HOST/PATH", _ENCRYPTED, "curve_socket:CurveSocketTarget", _of_url, 443, _TOKEN,
               "websockets"),
    TargetKind("window", "window", "a window on this machine", "window:WindowTarget", _of_nothing),
)  # fmt: skip
KINDS: Mapping[str, TargetKind] = MappingProxyType({kind.scheme: kind for kind in TARGETS})


def parse_target(text: str) -> Address:
    """Address of a target; another kind, and an address or an option of another form, is refused (`InputError`)."""
    place, _, options = text.strip().partition("#")
    scheme, _, rest = place.partition(":")
    kind = KINDS.get(scheme)
    if kind is None:
        raise InputError(
            f"there is no target {scheme[:40]!r}; the targets are {', '.join(known.form for known in TARGETS)}"
        )
    address = kind.parse(kind, rest)
    found = parse_options(options, kind.options, kind.form)
    kbps = found.get("kbps")
    if kbps is not None and not (kbps.isdecimal() and KBPS_LIMITS[0] <= int(kbps) <= KBPS_LIMITS[1]):
        raise InputError(f"kbps must be a whole number from {KBPS_LIMITS[0]} to {KBPS_LIMITS[1]}, not {kbps[:20]!r}")
    return Address(address.kind, address.host, address.port, address.url, found)


def parse_targets(texts: Sequence[str]) -> tuple[Address, ...]:
    """Addresses of several targets, of which no two are the same place and key; raises as `parse_target`."""
    found = tuple(map(parse_target, texts))
    places = [(address.kind, address.url, address.options.get("key")) for address in found]
    for address, place in zip(found, places, strict=True):
        if places.count(place) > 1:
            raise InputError(f"the target {address.shown} is given twice; remove one of them")
    return found


def check_target(address: Address) -> None:
    """Refuse a target whose package is missing (`BackendError`), or a file with its token or key (`InputError`)."""
    package = KINDS[address.kind].package
    if package and find_spec(package) is None:
        raise BackendError(f"{address.shown} needs the package {package}; run: pip install 'tts2face[live]'")
    for name in SECRETS & address.options.keys():
        address.secret(name)


def named_targets(written: Sequence[str]) -> Mapping[str, str]:
    """Targets by the names that an operator gives them, of pairs ``NAME=TARGET``.

    Raises
    ------
    InputError
        A pair has another form, a name stands there twice, or a target is wrong, or a window.
    """
    found: dict[str, str] = {}
    for pair in written:
        name, _, target = pair.partition("=")
        if not _NAME.fullmatch(name) or not target or name in found:
            raise InputError(
                f"live targets are written as stage=rtmp://HOST/APP/KEY, each name once, not {name[:40]!r}"
            )
        if not parse_target(target).host:
            raise InputError(f"the live target {name} must be a place that a server reaches, not a window")
        found[name] = target
    return MappingProxyType(found)


def make_target(address: Address, format: "LiveFormat") -> "Target":
    """The target of an address; errors as `check_target`."""
    check_target(address)
    return KINDS[address.kind].load()(address, format)
