"""What all stores of segments share: names, results and errors."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from lexicon.errors import BackendError, DataError
from lexicon.inputs import parse_json
from tts2face.batch.segment_result import SegmentResult, result_from_json

RESULT_SUFFIX = ".json"


class StoreAwayError(BackendError):
    """The store cannot be reached now; another try may succeed."""


@dataclass(frozen=True, slots=True)
class StoredSegment:
    """A stored segment: its files together, and when it was stored, in seconds since 1970."""

    address: str
    n_bytes: int
    stored_s: float


def sum_files(files: Iterable[tuple[str, int, float]]) -> Iterator[StoredSegment]:
    """Segments of files given by address, bytes and time; a segment has the time of its latest file."""
    found: dict[str, StoredSegment] = {}
    for address, n_bytes, stored_s in files:
        other = found.get(address, StoredSegment(address, 0, 0.0))
        found[address] = StoredSegment(address, other.n_bytes + n_bytes, max(other.stored_s, stored_s))
    yield from found.values()


def parse_result(content: bytes) -> SegmentResult | None:
    """Result of its JSON; None if it is damaged, so that the segment is rendered again."""
    try:
        return result_from_json(parse_json(content.decode("utf-8"), "the result of a segment"))
    except (ValueError, TypeError, AttributeError, DataError):
        return None
