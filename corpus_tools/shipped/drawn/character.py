"""A drawn character: its shape, colours, eyes, brows, lashes, hair and clothes, as tables of numbers."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from corpus_tools.shipped.head.eyes import EyeStyle

Colour = tuple[float, float, float]  # sRGB, 0..1
Profile = tuple[tuple[float, float], ...]  # share of a length, value there
Tint = tuple[tuple[float, ...], tuple[float, ...], Colour]  # centre (|x|, y, z) and radii in mm, colour factor


@dataclass(frozen=True, slots=True, kw_only=True)
class Proportions:
    """The map of space that makes a drawn face of a person's; what all characters share of it stands in `sculpt`.

    Parameters
    ----------
    eye_gain, eye_reach
        Gain of lengths at the eyes' centres, and the distance in mm at which a third of it is left. The map of both
        eyes stays one-to-one up to a gain of about 1.3.
    nose_gain
        Gain of lengths at the nose; below 0 it becomes smaller.
    lips_thinner
        Share by which the lips lose height.
    lips_back, chin_up, chin_forward : mm
    jaw_taper
        Share by which the face narrows towards the chin.
    upper_cheek, lower_cheek : mm
        Bulge of the cheekbone, and of the fat above the jaw.
    corners_up, middle_down : mm
        A smile in the line between the lips: rise of its corners, and dip of its middle.
    skull_gain, neck_thinner
        Gain of lengths at the top of the skull, and share by which the neck becomes thinner.
    jaw : mm
        Breadth of the jaw below the ears.
    drawn
        Share of the smoothing and of the changes that all drawn faces have; 0 for the proportions of a person.
    """

    eye_gain: float = 0.0
    eye_reach: float = 35.0
    nose_gain: float = 0.0
    lips_thinner: float = 0.0
    lips_back: float = 0.0
    jaw_taper: float = 0.0
    chin_up: float = 0.0
    chin_forward: float = 0.0
    upper_cheek: float = 0.0
    lower_cheek: float = 0.0
    corners_up: float = 0.0
    middle_down: float = 0.0
    skull_gain: float = 0.0
    neck_thinner: float = 0.0
    jaw: float = 0.0
    drawn: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class CharacterColours:
    """Colours of a character.

    ``tints`` are applied to the skin in their order. ``hair`` is the colour of a lock's middle, ``hair_tip`` that of
    its tip.
    """

    skin: Colour
    ears: Colour  # factors
    lids: Colour
    tints: tuple[Tint, ...]
    lips: Colour
    lip_strength: float
    n_freckles: int = 0
    cavity: Colour
    lid_line: Colour  # factor at the edge of the upper lid
    crease: Colour  # factor above it
    waterline: Colour
    hair: Colour
    hair_tip: Colour
    brows: Colour
    lashes: Colour
    iris_dark: Colour
    iris: Colour
    iris_light: Colour
    iris_rim: Colour
    pupil: Colour = (0.02, 0.015, 0.015)
    sclera: Colour = (0.95, 0.935, 0.92)
    cloth: Colour
    teeth: Colour = (0.97, 0.955, 0.925)
    tear_line: float = 1.0  # of its brightness: it takes the light of the skin


@dataclass(frozen=True, slots=True, kw_only=True)
class Brow:
    """A brow: its middle line (|x|, y) in front view in mm, and half width and thickness in mm along it.

    One with a number of ``hairs`` is painted on the skin, hair by hair, and has no thickness.
    """

    line: tuple[tuple[float, float], ...]
    half_width: Profile
    thickness: Profile = ()
    hairs: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Lock:
    """A lock of hair: a tapering tube with a lens for a section.

    Parameters
    ----------
    path
        Azimuth and elevation in degrees and height in mm over the volume of the hair (`tts2face` heads look along
        azimuth 0; the person's left is positive); elevations below 0 lie on a drop that reaches to the lowest tips.
    half_width, thickness : mm
        At the widest.
    root, tip
        Share of the width at the root, and gain of the width towards the tip.
    bluntness
        0 for a pointed tip, 1 for a blunt one.
    ridges
        Number of faint ridges along it.
    hollow
        Depth of the underside, in thicknesses.
    is_ball
        Elliptical along and across, as buns and puffs are, whatever the root and tip.
    clearance : mm
        Least distance of its middle line from the skin.
    curls : mm
        Height of curls over its surface; 0 for straight hair.
    loose
        Share of a lag of the hair that its tip follows, or a whole ball.
    """

    path: tuple[tuple[float, float, float], ...]
    half_width: float
    thickness: float
    root: float = 0.55
    tip: float = 1.0
    bluntness: float = 0.0
    ridges: int = 2
    hollow: float = 0.35
    is_ball: bool = False
    clearance: float = 3.0
    curls: float = 0.0
    loose: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Curls:
    """Round curls all over the head, as one surface.

    Parameters
    ----------
    lift : mm
        Height over the skin at the crown.
    width, height : mm
        Of a curl.
    sides
        Share of the lift above the ears.
    """

    lift: float
    width: float
    height: float
    sides: float = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hairstyle:
    """Locks over a shell that fills their gaps, or curls over it.

    ``name`` and ``summary`` are as in lists of haircuts. ``hairline`` gives the elevation in degrees of the edge of the
    hair by azimuth, from behind the person's right over the front to behind the left. ``shell_lift`` is the height of
    the shell in mm; ``fade`` is the height in degrees over the hairline in which cropped hair turns from the colour of
    the skin to its own, 0 for none.
    """

    name: str
    summary: str = ""
    locks: tuple[Lock, ...]
    hairline: Profile
    shell_lift: float
    fade: float = 0.0
    curls: Curls | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Collar:
    """A rolled collar: an ellipse about the neck, higher behind.

    ``across``, ``ahead`` and ``behind`` are its half sizes, ``front`` and ``back`` its heights and ``middle`` the depth
    of its centre, ``half_width`` and ``half_height`` those of the roll, all in mm; ``tilt`` in degrees.
    """

    across: float
    ahead: float
    behind: float
    front: float
    back: float
    middle: float
    half_width: float
    half_height: float
    tilt: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnCharacter:
    """A drawn character.

    ``targets`` are weights of MakeHuman's targets; ``rest`` are weights of the face's shapes that it has at rest.
    ``lashes`` is the length of the upper lashes in mm along the lid, from the inner corner to the outer. The top of the
    upper lip does not follow the share ``still_lip`` of a lift; more where the lip is close to the nose. ``pucker`` is
    the gain of `mouthPucker`: a wide mouth needs more of it to look round. The lower teeth lie ``teeth_back`` mm
    further behind the lips: those of a short chin would else come through it when the jaw moves ahead. ``seams`` is the
    depth and darkness of the seams between teeth, 1 for the faint ones of a drawn face.
    """

    name: str
    summary: str
    targets: Mapping[str, float]
    proportions: Proportions
    palette: CharacterColours
    eyes: EyeStyle
    brow: Brow
    lashes: Profile
    hair: Hairstyle
    collar: Collar | None
    rest: Mapping[str, float]
    still_lip: float = 0.6
    pucker: float = 1.0
    teeth_back: float = 0.0
    seams: float = 1.0
    skin_material: Mapping[str, Any] = field(
        # a soft sheen: .07 looks like wax, .16 like plastic
        default_factory=lambda: {"specular": 0.13, "shininess": 9.0, "wrap": 0.7, "texture": 0, "kind": "skin"}
    )
    has_studs: bool = False
    glasses: Colour | None = None
