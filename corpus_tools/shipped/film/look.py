"""Materials and light of a character: one table of choices, in the path tracer's terms.

Lengths of lamps and the wall are in decimetres, about the middle between the eyes; x is the person's left, y up, z
towards the viewer. Colours are linear light, or sRGB where a field says so.
"""

from dataclasses import dataclass, field, replace

Vector = tuple[float, float, float]

WHITE = 0.95  # of the eyeballs while their light is baked


@dataclass(frozen=True, slots=True, kw_only=True)
class SkinLook:
    """Skin: its painted texture with light scattered below it.

    ``scatter_mm`` is the mean free path of red light, ``scatter`` that of red, green and blue relative to it.
    ``lip_colour`` and ``inner_colour`` (sRGB) are mixed in at lips and inside the mouth.
    """

    gain: Vector = (1.06, 1.02, 1.0)
    saturation: float = 0.97
    scatter_mm: float = 2.8
    scatter: Vector = (1.0, 0.40, 0.24)
    specular: float = 0.48
    roughness: float = 0.40
    sheen: float = 0.12
    bump: float = 0.09
    pores: float = 60.0
    mottle: float = 0.0
    lip_colour: Vector = (0.80, 0.30, 0.31)
    lip_share: float = 0.35
    lip_roughness: float = 0.26
    inner_colour: Vector = (0.58, 0.19, 0.18)


@dataclass(frozen=True, slots=True, kw_only=True)
class HairLook:
    """Sculpted hair: colours of the vertices with streaks along the locks, and gloss across them.

    Chestnut that is 1.8 times as light turns ginger under the warm key light.
    """

    gain: Vector = (1.1, 1.03, 1.08)
    roughness: float = 0.50
    anisotropy: float = 0.90
    specular: float = 0.26
    specular_tint: Vector = (1.0, 0.72, 0.5)
    sheen: float = 0.2
    sheen_tint: Vector = (1.0, 0.7, 0.5)
    streaks: float = 0.38
    variation: float = 0.5
    bump: float = 0.22
    strands: float = 34.0


@dataclass(frozen=True, slots=True, kw_only=True)
class ClothLook:
    """Wool: ribs around the collar, columns of stitches below it."""

    roughness: float = 0.92
    sheen: float = 0.6
    sheen_tint: Vector = (1.0, 0.88, 0.62)
    bump: float = 0.5
    ribs: int = 92
    column_mm: float = 4.2
    groove: Vector = (0.55, 0.42, 0.30)
    depth: float = 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class EyeLook:
    """Eyeballs: their texture times ``gain``, and a cornea of ``height`` and ``bulge``, in radii, over them."""

    gain: float = 1.45
    roughness: float = 0.35
    scatter: float = 0.15
    height: float = 0.004
    bulge: float = 0.012


@dataclass(frozen=True, slots=True, kw_only=True)
class Lamp:
    """A rectangle that shines towards a target.

    ``parts`` names the only parts that it lights, empty for all. One that ``follows_head`` turns twice as far as the
    head: its mirror image in an eye keeps its place there.
    """

    place: Vector
    target: Vector
    width: float
    height: float
    watts: float
    colour: Vector
    parts: tuple[str, ...] = ()
    follows_head: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A box before the wall; it glows if ``glow`` is above 0. ``colour`` is sRGB."""

    low: Vector
    high: Vector
    colour: Vector
    glow: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Wall:
    """The wall behind, out of focus; ``colour`` is sRGB."""

    depth: float = -9.0
    colour: Vector = (0.30, 0.42, 0.47)
    lamps: tuple[Lamp, ...] = ()
    boxes: tuple[Box, ...] = ()
    f_stop: float = 0.35


LAMPS = {
    "key": Lamp(
        place=(-3.4, 3.4, 4.9), target=(0, -0.2, 0), width=2.2, height=2.6, watts=460, colour=(1, 0.84, 0.67)
    ),
    "fill": Lamp(place=(4.8, 0, 4.6), target=(0, -0.3, 0), width=4.5, height=4.5, watts=34, colour=(0.74, 0.86, 1)),
    "left rim": Lamp(
        place=(-4.2, 2.4, -3), target=(0, 0.1, -0.6), width=1, height=3, watts=120, colour=(0.70, 0.84, 1)
    ),
    "right rim": Lamp(
        place=(4.6, 2, -2), target=(0, 0, -0.5), width=1, height=3, watts=560, colour=(0.78, 0.89, 1)
    ),
    "floor": Lamp(place=(0, -4, 3.4), target=(0, -0.5, 0), width=3, height=3, watts=40, colour=(1, 0.74, 0.55)),
    "top": Lamp(
        place=(-0.8, 5.2, -0.6), target=(0, 0.8, -0.6), width=2.6, height=1.2, watts=110, colour=(1, 0.88, 0.74)
    ),
    "mouth": Lamp(
        place=(0, -1.6, 6.5), target=(0, -0.6, 0), width=0.6, height=0.6, watts=80, colour=(1, 0.92, 0.85),
        parts=("teeth", "gums", "tongue"),
    ),
    # Without it, the key light leaves the eyes when the head turns or bows, and they look dull.
    "catch": Lamp(
        place=(-3.4, 3.4, 4.9), target=(0, -0.2, 0), width=2.0, height=2.4, watts=600, colour=(1, 0.88, 0.74),
        parts=("cornea",), follows_head=True,
    ),
}  # fmt: skip
WALL = Wall(
    lamps=(
        Lamp(
            place=(5.0, 3.2, -6.5), target=(3.0, 1.2, -9.0), width=1.5, height=1.5, watts=1000, colour=(1, 0.66, 0.36)
        ),
        Lamp(place=(-6, 4, -4), target=(-4, 1, -9), width=2.0, height=2.0, watts=150, colour=(0.55, 0.75, 1.0)),
    ),
    boxes=(
        Box(low=(1.6, -6, -8.4), high=(4.4, 0.6, -7.6), colour=(0.5, 0.33, 0.24)),
        Box(low=(-7, -6, -8.6), high=(-3.6, 3.2, -8.2), colour=(0.2, 0.3, 0.36)),
        Box(low=(2.3, 0.6, -8.1), high=(2.7, 1.6, -7.8), colour=(0.95, 0.75, 0.45), glow=6),
        Box(low=(-2.6, 2.3, -8.5), high=(-2.3, 2.6, -8.3), colour=(1, 0.7, 0.4), glow=10),
        Box(low=(4.4, 2.0, -8.5), high=(4.6, 2.2, -8.3), colour=(1, 0.75, 0.5), glow=10),
        Box(low=(-6.2, 0.4, -8.2), high=(-5.6, 1.2, -8.0), colour=(0.7, 0.9, 1.0), glow=3),
    ),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """Materials, lamps, wall and exposure of a character.

    Key to fill 13 in power, about 3 stops: at 52 to 85 W of fill the face is flat. The right rim grazes the cheek; a
    left rim of 230 W turns hair to lilac plastic.
    """

    skin: SkinLook = field(default_factory=SkinLook)
    hair: HairLook = field(default_factory=HairLook)
    cloth: ClothLook = field(default_factory=ClothLook)
    eye: EyeLook = field(default_factory=EyeLook)
    lamps: dict[str, Lamp] = field(default_factory=lambda: dict(LAMPS))
    sky: Vector = (0.55, 0.66, 0.85)
    sky_strength: float = 0.13
    exposure: float = 0.63  # stops
    wall: Wall = field(default_factory=lambda: WALL)


def _dimmed(name: str, watts: float) -> dict[str, Lamp]:
    return LAMPS | {name: replace(LAMPS[name], watts=watts)}


# Of characters that are not lit as the drawn woman is. Gloss of the first skin is white plastic on brown skin, and lips
# of her pink are paint.
LOOKS = {
    "ben": Look(
        skin=SkinLook(
            specular=0.34, roughness=0.48, sheen=0.06, scatter_mm=2.2, lip_colour=(0.55, 0.25, 0.22), lip_share=0.25
        ),
        hair=HairLook(specular=0.16, anisotropy=0.7, roughness=0.56, sheen=0.1),
        lamps=_dimmed("right rim", 330),
    ),
    "noor": Look(
        skin=SkinLook(lip_colour=(0.70, 0.30, 0.30), lip_share=0.3),
        hair=HairLook(specular=0.2, streaks=0.25, variation=0.1, gain=(1.0, 0.98, 0.97)),
        lamps=_dimmed("right rim", 400),
    ),
    "zuri": Look(
        skin=SkinLook(
            specular=0.30, roughness=0.50, sheen=0.05, scatter_mm=2.0, lip_colour=(0.50, 0.20, 0.19), lip_share=0.3,
            inner_colour=(0.50, 0.16, 0.16),
        ),
        hair=HairLook(specular=0.2, anisotropy=0.4, roughness=0.56, sheen=0.15, gain=(1.35, 1.25, 1.25)),
        lamps=_dimmed("right rim", 300),
        exposure=0.73,
    ),
    "mara": Look(
        skin=SkinLook(
            specular=0.45, roughness=0.42, sheen=0.06, scatter_mm=2.4, bump=0.25, pores=110.0, mottle=0.7,
            lip_colour=(0.72, 0.33, 0.32), lip_share=0.25,
        ),
        hair=HairLook(strands=70.0, streaks=0.85, variation=0.8, bump=0.8, roughness=0.34, specular=0.35),
    ),
    "tomas": Look(
        skin=SkinLook(
            specular=0.38, roughness=0.45, sheen=0.05, scatter_mm=2.2, bump=0.35, pores=110.0, mottle=0.6,
            lip_colour=(0.58, 0.29, 0.26), lip_share=0.2,
        ),
        hair=HairLook(
            strands=70.0, streaks=0.7, variation=0.5, bump=0.8, roughness=0.42, specular=0.12, anisotropy=0.75,
            sheen=0.03,
        ),
        lamps=_dimmed("right rim", 380),
    ),
}  # fmt: skip


def look_of(name: str) -> Look:
    """Materials and lamps of a character."""
    return LOOKS.get(name, Look())
