"""Work done ahead of its use."""

import threading
import time
from collections.abc import Iterator

import pytest

from tts2face.ahead import made_ahead


def test_same_items_in_the_same_order() -> None:
    assert list(made_ahead(range(50), 3)) == list(range(50))


def test_no_more_than_the_room_is_made_ahead() -> None:
    made: list[int] = []

    def source() -> Iterator[int]:
        for number in range(100):
            made.append(number)
            yield number

    items = made_ahead(source(), 2)
    assert next(items) == 0
    time.sleep(0.3)
    assert len(made) <= 5
    items.close()


def test_an_error_comes_where_its_item_would() -> None:
    def source() -> Iterator[int]:
        yield 1
        raise ValueError("broken")

    items = made_ahead(source(), 2)
    assert next(items) == 1
    with pytest.raises(ValueError, match="broken"):
        next(items)


def test_the_maker_ends_when_nobody_asks_any_more() -> None:
    before = threading.active_count()
    items = made_ahead(iter(int, 1), 1)  # endless
    next(items)
    items.close()
    time.sleep(0.5)
    assert threading.active_count() <= before
