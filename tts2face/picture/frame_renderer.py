"""Protocol of the renderers, which draw the frames of a clip as pictures."""

from collections.abc import Iterable, Iterator
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tts2face.picture.options import Picture
from tts2face.storage.marks import Mark
from tts2face.types import Clip


class FrameRenderer(Protocol):
    """Renderer of clips of one face at one picture size; may be used from several threads.

    Pictures do not depend on the number of threads.
    """

    @property
    def picture(self) -> Picture:
        """Drawing options of the frames."""

    @property
    def mark(self) -> Mark:
        """Mark of every file with these frames."""

    def frames(
        self, clip: Clip, numbers: Iterable[int] | None = None, *, threads: int | None = None, first: int = 0
    ) -> Iterator[NDArray[np.uint8]]:
        """Pictures (H, W, 3), or (H, W, 4) with coverage, of a clip's frames in order.

        `numbers` names frames, each when its drawing begins; None: all. At most `threads` frames are drawn in advance;
        `first` is the index of the clip's first frame in a stream of clips.

        Raises
        ------
        InputError
            The clip's motion is not in the channels of this face.
        """

    def frame(self, clip: Clip, number: int) -> NDArray[np.uint8]:
        """Picture of one frame of a clip."""

    def with_fewest_samples(self) -> "FrameRenderer":
        """Renderer with one sample a pixel, which draws faster where samples cost time."""
