"""Added teeth and the inside of an added mouth, kept behind lips and chin in every pose of the mouth."""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import maximum_filter1d, uniform_filter1d

from tts2face.interchange.characters.transfer.parts import triangles_of
from tts2face.interchange.characters.transfer.sight import view_ahead
from tts2face.models.face import Face
from tts2face.numeric.arrays import FloatArray, IntArray

TEETH_MM, INSIDE_MM = 1.0, 2.0  # of skin before teeth and before the inside of the mouth, on the shipped head
BEHIND_MM = 25.0  # farther behind its place skin is seen through the open mouth, and covers nothing
MOST_MM = 12.0  # by which teeth are moved back
STEP_MM = 1.0  # of the view
SPREAD = 5  # columns of the mouth over which a move is spread
LEFT, RIGHT = "Left", "Right"


def keep_covered(face: Face, mouth: IntArray, teeth: IntArray, scale: float) -> Face:
    """Face whose added parts lie behind the skin before them, at rest and in every shape of the mouth.

    Parameters
    ----------
    mouth : (2, R, N)
        Vertices of the inside of the mouth behind each lip, by rows from the lip to the throat.
    teeth : (T,)
        Vertices of added teeth, which move back as one.
    scale
        Size of the face over that of the shipped head.
    """
    rows = np.concatenate([mouth.ravel(), teeth])
    least = np.repeat([INSIDE_MM, TEETH_MM], [mouth.size, len(teeth)]) * scale
    back = np.zeros(len(rows))
    skin = face.triangles[triangles_of(face, "skin")]
    for moves in _poses(face):
        places = face.vertices + moves
        flat = places[rows]
        box = (flat.min(axis=0) - STEP_MM, flat.max(axis=0) + STEP_MM)
        sight = view_ahead(places, skin, box, STEP_MM)
        column, row = np.floor((flat[:, :2] - sight.low) / sight.step).astype(np.int64).T
        cover = sight.depth[column, row] - flat[:, 2]
        back = np.maximum(back, np.where(cover > -BEHIND_MM * scale, least - cover, 0.0))
    vertices = face.vertices.copy()
    inside = maximum_filter1d(back[: mouth.size].reshape(mouth.shape), SPREAD, axis=2)
    vertices[mouth, 2] -= uniform_filter1d(inside, SPREAD, axis=2).astype(np.float32)
    vertices[teeth, 2] -= np.float32(min(float(back[mouth.size :].max(initial=0.0)), MOST_MM * scale))
    return replace(face, vertices=vertices)


def _poses(face: Face) -> Iterator[FloatArray]:
    """Displacements (V, 3) at rest and by the shapes of jaw and mouth; those of two sides at once."""
    yield np.zeros(face.vertices.shape)
    names: Sequence[str] = face.shape_names
    for number, name in enumerate(names):
        if not name.startswith(("jaw", "mouth", "noseSneer", "cheek")):
            continue
        other = name.removesuffix(LEFT) + RIGHT
        if name.endswith(LEFT) and len(name) > len("mouthLeft") and other in names:
            yield (face.shapes[number] + face.shapes[names.index(other)]).astype(np.float64)
        elif name == "mouthClose":
            yield (face.shapes[number] + face.shapes[names.index("jawOpen")]).astype(np.float64)
        elif not name.endswith(RIGHT) or len(name) <= len("mouthRight"):
            yield face.shapes[number].astype(np.float64)
