"""Who may use a service, asked at each request and at each utterance of an open connection."""

import asyncio
import logging
from pathlib import Path

from fastapi import Request as HttpRequest

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import LOCAL_KEY, NOBODY, ApiKey, find_key, read_keys
from tts2face.serving.service.logs import log_event


class KeyRing:
    """Who may use a service: everybody who reaches it if no file of keys is named, otherwise whom the file names now.

    A named file never opens the service, however few keys it holds and whatever is wrong with it.
    """

    def __init__(self, path: Path | None) -> None:
        self._path, self._keys = path, () if path is None else read_keys(path)
        self._reading = asyncio.Lock()
        self._note_if_empty()

    @property
    def is_open(self) -> bool:
        """Whether no key is asked for, as no file of keys is named."""
        return self._path is None

    def find(self, given: str) -> ApiKey:
        """Key of a secret; `LOCAL_KEY` for all secrets if no key is asked for.

        Raises
        ------
        RefusedError
            There is none.
        """
        found = LOCAL_KEY if self.is_open else find_key(self._keys, given)
        if found is None:
            what = f"the API key is {'unknown' if given else 'missing'}; send it as `Authorization: Bearer KEY`"
            raise _unauthorized(what if self._keys else "the service has no API keys now; ask its operator for one")
        return found

    def current(self, key: ApiKey) -> ApiKey:
        """A key that was found earlier, as it is now; raises as `find` if it has been removed."""
        if self.is_open:
            return key
        found = next((held for held in self._keys if held.hash == key.hash), None)
        if found is None and not self._keys:
            raise _unauthorized("the service has no API keys now, so that nobody is served; ask its operator")
        if found is None:
            raise _unauthorized(f"the API key {key.name} has been removed; connect with another one")
        return found

    def with_scope(self, key: ApiKey, scope: str) -> ApiKey:
        """A key as it is now, if it has a scope."""
        key = self.current(key)
        if scope not in key.scopes:
            raise RefusedError(403, "forbidden", f"the key {key.name} lacks the scope {scope}; use another key")
        return key

    def loss_of(self, key: ApiKey) -> RefusedError | None:
        """Why what is open for a key ends: it has been removed, or may do less than it might; None: neither."""
        if key is NOBODY:
            return None
        try:
            lost = set(key.scopes) - set(self.current(key).scopes)
        except RefusedError as removed:
            return removed
        return (
            _unauthorized(f"the API key {key.name} has lost {', '.join(sorted(lost))}; connect again") if lost else None
        )

    def named(self, name: str) -> ApiKey | None:
        """The key of a name."""
        return next((key for key in ((LOCAL_KEY,) if self.is_open else self._keys) if key.name == name), None)

    async def reload(self) -> tuple[str, ...]:
        """Read the file again, in a thread, as its disk may be slow; names of its keys.

        The keys stay as they are until it has been read.
        """
        async with self._reading:
            found: tuple[ApiKey, ...] = ()
            try:
                found = () if self._path is None else await asyncio.to_thread(read_keys, self._path)
            finally:
                self._keys = found
                self._note_if_empty()
        return tuple(key.name for key in found)

    def _note_if_empty(self) -> None:
        if not self.is_open and not self._keys:
            log_event("no keys", level=logging.ERROR, reason=f"{self._path} has no valid key, so nobody is served")


def _unauthorized(message: str) -> RefusedError:
    return RefusedError(401, "unauthorized", message, {"WWW-Authenticate": "Bearer"})


def require_scope(request: HttpRequest, scope: str, what: str) -> ApiKey:
    """Key of a request, which must have a scope; `what` names in the plural what needs it."""
    key: ApiKey = request.state.key
    if scope not in key.scopes:
        raise RefusedError(403, "forbidden", f"{what} need a key with the scope {scope}; this one has none such")
    return key
