"""Selection of the parts of a face."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from tts2face.models.face import Face, Part


def keep_parts(face: Face, is_kept: Callable[[Part], bool]) -> Face:
    """A face with the triangles of some of its parts; its vertices stay, so that landmarks and eyes hold.

    Baked light is left out: it belongs to all parts.
    """
    kept, triangles, first = [], [np.zeros((0, 3), np.int32)], 0
    for part in face.parts:
        if is_kept(part):
            kept.append(replace(part, first=first))
            triangles.append(face.triangles[part.first : part.first + part.count])
            first += part.count
    return replace(face, parts=tuple(kept), triangles=np.concatenate(triangles), light=())
