"""Links to complete files of what has been spoken: the orders are kept, and made again when a link is followed."""

import secrets
from collections import Counter
from dataclasses import dataclass, replace

from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.messages import Work

MAX_CHARACTERS = 4_000_000  # of the texts of all links, up to 16 MB; then the key that has most loses its oldest


@dataclass(frozen=True, slots=True)
class _Link:
    owner: str
    work: Work
    size: int


class Downloads:
    """Tasks by the names of their links, each for the key that has asked for it."""

    def __init__(self) -> None:
        self._links: dict[str, _Link] = {}
        self._sizes: Counter[str] = Counter()  # characters by owner

    def add(self, owner: str, work: Work, format: str) -> str:
        """Name of a link to the complete file of a task in a format."""
        name = f"{secrets.token_hex(12)}.{format}"
        complete = replace(work, kind="file", format=format, is_complete=True, keeps_pace=False)
        size = len(str(work.request)) + len(name)
        self._links[name] = _Link(owner, complete, size)
        self._sizes[owner] += size
        # the key that has most loses, so that one key cannot push out the links of others
        while self._sizes.total() > MAX_CHARACTERS:
            largest = self._sizes.most_common(1)[0][0]
            oldest = next(name for name, link in self._links.items() if link.owner == largest)
            self._sizes[largest] -= self._links.pop(oldest).size
        return name

    def find(self, owner: str, name: str) -> Work:
        """Work of a link.

        Raises
        ------
        RefusedError
            The key has no such link, or no longer.
        """
        link = self._links.get(name)
        # 404 for both: another key learns of no name
        if link is None or link.owner != owner:
            raise RefusedError(404, "not_found", f"there is no file {name[:40]!r}, or no longer; speak the text again")
        return link.work
