"""Five vowels and blinks of VRM's avatars by weights of ARKit's shapes."""

from dataclasses import dataclass

import numpy as np

from tts2face.face.landmarks import landmark_motion, scatter_landmarks
from tts2face.face.lip_constraints import SPEECH_SHAPE_PREFIXES
from tts2face.face.mouth import CORNERS_LEFT, CORNERS_RIGHT, mouth_products
from tts2face.face.shape_transfer import default_head
from tts2face.face.stand_in import viseme_table
from tts2face.interchange.exports.arkit import ARKIT_SHAPES
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER
from tts2face.numeric.arrays import FloatArray, IntArray

UNROUNDED, ROUNDED = ("aa", "ih", "ee", "oh"), "ou"
OPEN_ROUND = 0.5  # of what an oh as open as the lips narrows them, which is then no ou
LIKE = 0.05  # difference of two cosines of motion at which one vowel has e times the share of the other


@dataclass(frozen=True, slots=True, eq=False)
class VowelProjection:
    """Weights of vowels whose mouth is like that of weights of ARKit's shapes.

    Lips that narrow more than they open are ou. The rest is divided by the likeness of the mouth's motion to the other
    vowels, and opens the lips as far; closed lips are no vowel. Least squares on the motion would add ou to ih, whose
    widths cancel.

    Parameters
    ----------
    columns : (S,)
        Shapes (of the 52) that move the mouth.
    made : (5, S)
        Their weights in the vowels, ou last.
    opening, width : (S,)
        By which each opens and widens the lips.
    products : (S, S)
        Inner products of their motion.
    """

    columns: IntArray
    made: FloatArray
    opening: FloatArray
    width: FloatArray
    products: FloatArray

    def weights(self, weights: FloatArray) -> dict[str, FloatArray]:
        """Weights (T,) by vowel from weights (T, 52)."""
        shown = weights[:, self.columns]
        gap = np.maximum(shown @ self.opening, 0.0)
        ajar = np.clip(gap / (self.made[-1] @ self.opening), 0.0, 1.0)
        open_round = self.made[UNROUNDED.index("oh")]
        narrowed = shown @ self.width - OPEN_ROUND * gap / (open_round @ self.opening) * (open_round @ self.width)
        rounded = ajar * np.clip(narrowed / (self.made[-1] @ self.width), 0.0, 1.0)
        length = np.sqrt(np.einsum("ti,ij,tj->t", shown, self.products, shown))
        lengths = np.sqrt(np.einsum("ni,ij,nj->n", self.made[:-1], self.products, self.made[:-1]))
        likeness = shown @ self.products @ self.made[:-1].T / np.maximum(np.outer(length, lengths), 1e-9)
        shares = np.exp((likeness - likeness.max(axis=1, keepdims=True)) / LIKE)
        shares /= shares.sum(axis=1, keepdims=True)
        opened = np.clip(gap / (shares @ self.made[:-1] @ self.opening), 0.0, 1.0)
        unrounded = ((1.0 - rounded) * opened)[:, None] * shares
        return {**dict(zip(UNROUNDED, unrounded.T, strict=True)), ROUNDED: rounded}


def vowel_projection() -> VowelProjection:
    """The projection by the mouth of the default head."""
    head, table = default_head(), viseme_table()
    names = [name for name in ARKIT_SHAPES if name.startswith(SPEECH_SHAPE_PREFIXES) and name in head.shape_names]
    rows = np.array([head.shape_names.index(name) for name in names])
    columns = np.array([ARKIT_SHAPES.index(name) for name in names])
    made = np.array([[table[vowel].get(name, 0.0) for name in names] for vowel in (*UNROUNDED, ROUNDED)])
    motion = scatter_landmarks(head, landmark_motion(head, rows))
    opening = (motion[list(INNER_LIP_UPPER), 1] - motion[list(INNER_LIP_LOWER), 1]).mean(axis=0)
    width = motion[list(CORNERS_LEFT), 0].mean(axis=0) - motion[list(CORNERS_RIGHT), 0].mean(axis=0)
    return VowelProjection(columns, made, opening, width, mouth_products(head, rows))


def blinks(weights: FloatArray) -> dict[str, FloatArray]:
    """Weights (T,) of blinks: what both lids do, and what one does beyond it, so that no lid closes twice."""
    left, right = (weights[:, ARKIT_SHAPES.index(f"eyeBlink{side}")] for side in ("Left", "Right"))
    both = np.minimum(left, right)
    return {"blink": both, "blinkLeft": left - both, "blinkRight": right - both}
