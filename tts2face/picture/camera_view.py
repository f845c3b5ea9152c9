"""Camera positions: named views, or angles and a distance."""

import math
from dataclasses import dataclass

from lexicon.errors import InputError

MAX_DISTANCE_MM = 100_000.0
MIN_DISTANCE_MM = 50.0


@dataclass(frozen=True, slots=True)
class CameraView:
    """Position of the camera relative to the head.

    ``yaw_deg`` is positive towards the face's own left, ``pitch_deg`` positive from above; ``distance`` is in mm from
    the centre of the head, 0 for the distance that frames it; ``share`` is the visible share of the framing box.
    """

    yaw_deg: float
    pitch_deg: float
    distance: float = 0.0
    share: float = 1.0


NAMED_VIEWS = {
    "front": CameraView(0.0, 3.0),
    "three-quarter": CameraView(38.0, 4.0),
    "profile": CameraView(88.0, 2.0),
    "close": CameraView(0.0, 2.0, share=0.62),
}


def parse_camera(text: str) -> CameraView:
    """Camera view of a name, or of ``yaw,pitch`` or ``yaw,pitch,distance`` in degrees and mm.

    Raises
    ------
    InputError
        There is no such name, or the numbers are out of range.
    """
    if text in NAMED_VIEWS:
        return NAMED_VIEWS[text]
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if not 2 <= len(numbers) <= 3 or not all(math.isfinite(number) for number in numbers):
        raise InputError(
            f"there is no camera {text!r}; choose {', '.join(NAMED_VIEWS)}, or give yaw,pitch,distance such as 20,5,900"
        )
    yaw, pitch = numbers[:2]
    distance = numbers[2] if len(numbers) == 3 else 0.0
    if abs(yaw) > 180 or abs(pitch) > 85 or (len(numbers) == 3 and not MIN_DISTANCE_MM <= distance <= MAX_DISTANCE_MM):
        raise InputError(
            f"camera {text!r} is out of range; yaw is -180 to 180 and pitch -85 to 85 degrees, distance 50 to 100000 mm"
        )
    return CameraView(yaw, pitch, distance)
