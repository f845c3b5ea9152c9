"""Pictures of a face or of hair that are decoded when they are first needed."""

from collections.abc import Callable, Iterable, Sequence
from typing import TypeVar, overload

Item = TypeVar("Item")


class Late(Sequence[Item]):
    """Pictures that are decoded and painted when one of them is first read: files of motion need none.

    Parameters
    ----------
    number
        How many there are.
    make
        Makes all of them; raises `DataError` where a picture is damaged.
    """

    def __init__(self, number: int, make: Callable[[], Iterable[Item]]) -> None:
        self._number, self._make = number, make

    def _made(self) -> tuple[Item, ...]:
        made = tuple(self._make())
        self._make = lambda: made  # what they are made of is forgotten
        return made

    def __len__(self) -> int:
        """Their number; nothing is decoded."""
        return self._number

    @overload
    def __getitem__(self, index: int) -> Item: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[Item, ...]: ...
    def __getitem__(self, index: int | slice) -> Item | tuple[Item, ...]:
        """One or some of them."""
        return self._made()[index]

    def __reduce__(self) -> tuple[type, tuple[object, ...]]:
        """Another process gets them decoded."""
        return tuple, (self._made(),)
