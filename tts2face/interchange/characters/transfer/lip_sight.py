"""Line of the lips of a head: landmarks of the inner lips moved to where the lips are seen to meet."""

from dataclasses import replace

import numpy as np

from tts2face.interchange.characters.transfer.sight import STEP_MM, view_ahead
from tts2face.interchange.characters.transfer.skin import Skin
from tts2face.models.landmarks import INNER_LIP_LOWER, INNER_LIP_UPPER, OUTER_LIP_LOWER, OUTER_LIP_UPPER

MARGIN_MM = 3.0  # around the landmarks of the lips


def lips_in_sight(skin: Skin) -> Skin:
    """Skin whose landmarks of the inner lips lie at the edges that are seen from straight ahead; corners are unchanged.

    The tracker puts the inner upper lip up to 4 mm into the mouth.
    """
    moved = skin.landmarks.copy()
    lines = [*INNER_LIP_UPPER, *INNER_LIP_LOWER, *OUTER_LIP_UPPER, *OUTER_LIP_LOWER]
    if not np.isfinite(moved[lines]).all():
        return skin
    low, high = moved[lines].min(axis=0) - MARGIN_MM, moved[lines].max(axis=0) + MARGIN_MM
    sight = view_ahead(skin.vertices, skin.triangles, (low, high))
    shown = np.where(skin.is_seen[skin.triangles].any(axis=1), skin.side[skin.triangles].max(axis=1), 0)
    side = np.append(shown, 0)[sight.triangle]
    for upper, lower in zip(INNER_LIP_UPPER[1:-1], INNER_LIP_LOWER[1:-1], strict=True):
        column = int(((moved[upper, 0] + moved[lower, 0]) / 2 - sight.low[0]) / STEP_MM)
        above, below = (np.flatnonzero(side[column] == lip) for lip in (1, 2))
        if len(above) and len(below):
            for number, row in ((upper, above.min()), (lower, below.max())):
                place = sight.low + (np.array([column, row]) + 0.5) * STEP_MM
                moved[number] = (*place, sight.depth[column, row])
    return replace(skin, landmarks=moved)
