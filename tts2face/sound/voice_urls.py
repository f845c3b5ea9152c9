"""URLs of voices of servers, and the names that an operator gives them.

They come from the command line, from programs and from the operator: never from a client, a document or a file, which
would choose where texts are sent.
"""

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from urllib.parse import SplitResult, unquote, urlsplit

from lexicon.errors import DataError, InputError

SCHEMES = ("http://", "https://")
KEY_VARIABLE = "TTS2FACE_VOICE_KEY"  # environment variable of the key, sent as OpenAI's clients do
NAMES_VARIABLE = "TTS2FACE_VOICES"  # environment variable of named voices: kokoro=http://..., with spaces between
USUAL_MODEL = "tts-1"  # OpenAI's name, which Kokoro-FastAPI and others take, too
LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})
_FRAGMENT = re.compile(r"[^\s\x00-\x1f]{1,200}")
_NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,39}")
# Clients learn neither the address of a voice that the operator has named, nor what its server says of the key.
SERVER_FAILS = "the server of this voice fails, and the service's log says why; choose another voice"
_FAILURE = re.compile(r"the voice server https?://")
_OWN_WORDS = re.compile(r"(?<=\(\d{3}): .*(?=\))", re.DOTALL)  # of a server, which may quote the text


def failure_of_server(message: str) -> str | None:
    """For the log, what failed at the server of a voice, without its own words; None for any other message."""
    return _OWN_WORDS.sub("", message) if _FAILURE.search(message) else None


def is_voice_url(name: object) -> bool:
    """Whether the name of a voice is the URL of a server."""
    return isinstance(name, str) and name.lower().startswith(SCHEMES)


def refuse_voice_url(name: object, place: str) -> None:
    """Refuse the URL of a voice in a file (`DataError`), whose author would choose where texts are sent."""
    if is_voice_url(name):
        raise DataError(
            f"{place}: a voice by URL is taken from the command line alone; give it by --voice, or write a name of "
            f"{NAMES_VARIABLE}"
        )


def named_urls() -> Mapping[str, str]:
    """URLs of the voices that the operator has named, by their names; raises as `parse_named_urls`."""
    return parse_named_urls(os.environ.get(NAMES_VARIABLE, ""))


@lru_cache(maxsize=4)
def parse_named_urls(written: str) -> Mapping[str, str]:
    """URLs by names of pairs with spaces between: ``kokoro=http://127.0.0.1:8880/v1#af_heart``.

    Raises
    ------
    InputError
        A pair has another form.
    """
    found = {}
    for pair in written.split():
        name, _, url = pair.partition("=")
        if not _NAME.fullmatch(name) or not is_voice_url(url):
            raise InputError(f"named voices must be such as kokoro=http://localhost:80/v1#heart, not {pair[:80]!r}")
        parse_voice_url(url)
        found[name] = url
    return MappingProxyType(found)


@dataclass(frozen=True, slots=True)
class ServerAddress:
    """Address of a voice: ``http://host:port/v1#voice``, or ``#model/voice``."""

    base: str
    model: str
    voice: str
    is_this_machine: bool

    @property
    def place(self) -> str:
        """Address for messages, without the voice."""
        return self.base


def parse_voice_url(url: str) -> ServerAddress:
    """Address of a voice by its URL.

    A URL without host or voice is refused, and one with a password, which messages and lists would show.
    """
    form = "give http://host:port/v1#voice, with a model as #model/voice"
    try:
        parts: SplitResult = urlsplit(url)
        port = parts.port
    except ValueError as wrong:
        raise InputError(f"{url[:80]!r} is no URL of a voice ({wrong}); {form}") from wrong
    if parts.username is not None or parts.password is not None:
        raise InputError(f"the URL of a voice holds no password; put the key into {KEY_VARIABLE}")
    if not parts.hostname or not _FRAGMENT.fullmatch(parts.fragment) or parts.query:
        raise InputError(f"{url[:80]!r} names no server and voice; {form}")
    model, _, voice = unquote(parts.fragment).rpartition("/")
    host = f"[{parts.hostname}]" if ":" in parts.hostname else parts.hostname
    base = f"{parts.scheme}://{host}{'' if port is None else f':{port}'}{parts.path.rstrip('/')}"
    return ServerAddress(base, model or USUAL_MODEL, voice, parts.hostname in LOOPBACK)
