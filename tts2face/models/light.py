"""Kinds of light of a face: lamps that renderers set up, light that a path tracer has baked, and that of a photograph.

All three say whether the face `is_flat`: a picture, behind whose skin eyes and mouth lie and which no lamp lights.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from tts2face.models.baked_light import BakedLight
from tts2face.models.photo_view import PhotoView


@dataclass(frozen=True, slots=True)
class Lamps:
    """Light of a face that has none of its own."""

    is_flat: ClassVar[bool] = False


class _Lit:
    """Light that comes with a face, or what decodes it when it is first needed: files of motion need none."""

    __slots__ = ("__weakref__", "_light")

    def __init__(self, light: BakedLight | Callable[[], BakedLight]) -> None:
        self._light = light

    @property
    def baked(self) -> BakedLight:
        """The light; decoding it raises `DataError` where it is damaged."""
        if not isinstance(self._light, BakedLight):
            self._light = self._light()
        return self._light


class Baked(_Lit):
    """Light that a path tracer has baked."""

    __slots__ = ()
    is_flat: ClassVar[bool] = False

    def changed(self, change: Callable[[BakedLight], BakedLight]) -> Self:
        """Light that is changed when it is first needed."""
        return type(self)(lambda: change(self.baked))

    def bearable(self, head: NDArray[np.float32]) -> NDArray[np.float32]:
        """The part of a head pose (6,) that it bears: all of it."""
        return head

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Another process gets it decoded."""
        return type(self), (self.baked,)


class Photographed(_Lit):
    """Light of a photograph, and the view of the face that is moved in it."""

    __slots__ = ("view",)
    is_flat: ClassVar[bool] = True

    def __init__(self, light: BakedLight | Callable[[], BakedLight], view: PhotoView) -> None:
        super().__init__(light)
        self.view = view

    def changed(self, change: Callable[[BakedLight], BakedLight]) -> Self:
        """Light that is changed when it is first needed, in the same view."""
        return type(self)(lambda: change(self.baked), self.view)

    def bearable(self, head: NDArray[np.float32]) -> NDArray[np.float32]:
        """The part of a head pose (6,), rad and mm, that the picture bears."""
        return self.view.bearable(head)

    def __reduce__(self) -> tuple[type, tuple[Any, ...]]:
        """Another process gets it decoded."""
        return type(self), (self.baked, self.view)


Lit = Baked | Photographed
Light = Lamps | Lit
