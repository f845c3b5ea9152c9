"""Landmarks common to talkers and faces, the 478 points of the MediaPipe face mesh, and distances between them.

Indices follow the topology of Kartynnik et al. 2019, "Real-time facial surface geometry from monocular video on
mobile GPUs" (468 points), followed by ten iris points. "Left" and "right" are the person's own. Landmark
coordinates: x to the person's left, y up, z out of the face, millimetres, head pose removed.
"""

import numpy as np
from numpy.typing import NDArray

# of MediaPipe's face mesh with irises; the numbers below are its own
N_LANDMARKS = 478
N_MESH_LANDMARKS = 468  # landmarks of the skin; those after them lie on the irises and depend on gaze

UPPER_LIP_INNER_MID = 13
LOWER_LIP_INNER_MID = 14
MOUTH_CORNER_RIGHT = 61
MOUTH_CORNER_LEFT = 291
EYE_OUTER_RIGHT = 33
EYE_OUTER_LEFT = 263
CHIN = 152

# Inner lip line from the right corner to the left; entry k of one lies opposite entry k of the other.
INNER_LIP_UPPER = (78, 191, 80, 81, 82, 13, 312, 311, 310, 415, 308)
INNER_LIP_LOWER = (78, 95, 88, 178, 87, 14, 317, 402, 318, 324, 308)
OUTER_LIP_UPPER = (61, 185, 40, 39, 37, 0, 267, 269, 270, 409, 291)
OUTER_LIP_LOWER = (61, 146, 91, 181, 84, 17, 314, 405, 321, 375, 291)
LIP_LANDMARKS = (*OUTER_LIP_UPPER, *OUTER_LIP_LOWER, *INNER_LIP_UPPER, *INNER_LIP_LOWER)  # corners twice

# Margins of the lids (upper, lower), each from the outer corner of the eye to the inner one.
RIGHT_LIDS = ((33, 246, 161, 160, 159, 158, 157, 173, 133), (33, 7, 163, 144, 145, 153, 154, 155, 133))
LEFT_LIDS = ((263, 466, 388, 387, 386, 385, 384, 398, 362), (263, 249, 390, 373, 374, 380, 381, 382, 362))
# Upper and lower lid, outer and inner corner of each eye.
EYELID_LANDMARKS = {
    "Left": ((386, 385, 387), (374, 380, 373), 263, 362),
    "Right": ((159, 158, 160), (145, 153, 144), 33, 133),
}
# The same once around each eye from its outer corner, over the upper lid; the person's right eye, then the left.
LID_RINGS = tuple((*upper, *lower[-2:0:-1]) for upper, lower in (RIGHT_LIDS, LEFT_LIDS))

# Once around the face, from the top of the forehead over the person's left cheek and the chin.
FACE_OVAL = (
    10, 338, 297, 332, 284, 251, 389, 356, 454, 323, 361, 288, 397, 365, 379, 378, 400, 377, 152, 148, 176, 149, 150,
    136, 172, 58, 132, 93, 234, 127, 162, 21, 54, 103, 67, 109,
)  # fmt: skip

# Points that speech moves: every point of the canonical mesh lower than 0.5 mm under the base of the nose (landmark 2).
# This is region P of Ju and Lee 2008, Fig. 5; its complement carries expression.
MOUTH_REGION = (
    0, 11, 12, 13, 14, 15, 16, 17, 18, 32, 37, 38, 39, 40, 41, 42, 43, 57, 58, 61, 62, 72, 73, 74, 76, 77, 78, 80, 81,
    82, 83, 84, 85, 86, 87, 88, 89, 90, 91, 92, 95, 96, 106, 132, 135, 136, 138, 140, 146, 148, 149, 150, 152, 164,
    165, 167, 169, 170, 171, 172, 175, 176, 177, 178, 179, 180, 181, 182, 183, 184, 185, 186, 187, 191, 192, 194, 199,
    200, 201, 202, 204, 206, 207, 208, 210, 211, 212, 213, 214, 215, 216, 262, 267, 268, 269, 270, 271, 272, 273, 287,
    288, 291, 292, 302, 303, 304, 306, 307, 308, 310, 311, 312, 313, 314, 315, 316, 317, 318, 319, 320, 321, 322, 324,
    325, 335, 361, 364, 365, 367, 369, 375, 377, 378, 379, 391, 393, 394, 395, 396, 397, 400, 401, 402, 403, 404, 405,
    406, 407, 408, 409, 410, 411, 415, 416, 418, 421, 422, 424, 426, 427, 428, 430, 431, 432, 433, 434, 435, 436,
)  # fmt: skip


def lip_opening(landmarks: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T,) distance of the middle inner lips over that of the outer eye corners, of (T, L, 2 or 3) landmarks."""
    return _normalised_distance(landmarks, UPPER_LIP_INNER_MID, LOWER_LIP_INNER_MID)


def lip_width(landmarks: NDArray[np.floating]) -> NDArray[np.float64]:
    """(T,) distance of the mouth's corners over that of the outer eye corners, of (T, L, 2 or 3) landmarks."""
    return _normalised_distance(landmarks, MOUTH_CORNER_RIGHT, MOUTH_CORNER_LEFT)


def _normalised_distance(landmarks: NDArray[np.floating], first: int, second: int) -> NDArray[np.float64]:
    eyes = np.linalg.norm(landmarks[:, EYE_OUTER_LEFT] - landmarks[:, EYE_OUTER_RIGHT], axis=1)
    return np.asarray(np.linalg.norm(landmarks[:, first] - landmarks[:, second], axis=1) / eyes, np.float64)


def inner_lip_gaps(landmarks: NDArray[np.floating]) -> NDArray[np.float64]:
    """(..., P) vertical gaps of facing inner lip points, of (..., 478, 3) landmarks or modes."""
    gaps = landmarks[..., list(INNER_LIP_UPPER), 1] - landmarks[..., list(INNER_LIP_LOWER), 1]
    return np.asarray(gaps, np.float64)


def eye_aperture(landmarks: NDArray[np.floating], side: str) -> NDArray[np.float64]:
    """Lid distance (T,) over the width of an eye; `side` is ``Left`` or ``Right``."""
    return lid_aperture(landmarks[:, eyelid_numbers(side)])


def eyelid_numbers(side: str) -> list[int]:
    """Landmarks of an eye for `lid_aperture`: three of the upper lid, three of the lower one, both corners."""
    upper, lower, outer, inner = EYELID_LANDMARKS[side]
    return [*upper, *lower, outer, inner]


def lid_aperture(lids: NDArray[np.floating]) -> NDArray[np.float64]:
    """Lid distance (T,) over the width of an eye whose `eyelid_numbers` are at (T, 8, 3)."""
    height = np.linalg.norm(lids[:, :3] - lids[:, 3:6], axis=2).mean(axis=1)
    return np.asarray(height / np.linalg.norm(lids[:, 6] - lids[:, 7], axis=1), np.float64)
