"""Two people in film light: a woman with hair to her shoulders, a man with short hair combed back.

They have the proportions of people, painted brows and seams between their teeth; measures and rounds are in
docs/decisions/161-drawn.md.
"""

from dataclasses import replace

from corpus_tools.shipped.drawn.character import Brow, Collar, DrawnCharacter, Hairstyle, Lock, Proportions
from corpus_tools.shipped.drawn.man import PALETTE as DRAWN_MAN
from corpus_tools.shipped.drawn.man import SIDE
from corpus_tools.shipped.drawn.woman import HAIRLINE, LOCKS
from corpus_tools.shipped.drawn.woman import PALETTE as DRAWN_WOMAN
from corpus_tools.shipped.drawn.worn import comb, grow, lay_closer
from corpus_tools.shipped.head.eyes import EyeStyle
from corpus_tools.shipped.head.proportions import person_targets

DRAWN = 0.5  # of the smoothing and changes of drawn faces: with less, MakeHuman's planes are seen at nose and cheeks
SEAMS = 2.6
HER_PALETTE = replace(
    DRAWN_WOMAN,
    skin=(0.80, 0.60, 0.50), ears=(1.0, 0.94, 0.93), lids=(0.97, 0.92, 0.90),
    tints=(
        ((38, -32, 14), (20, 15, 30), (1.02, 0.89, 0.88)),  # cheeks
        ((0, -40, 40), (12, 10, 16), (1.0, 0.91, 0.90)),  # nose
        ((0, -101, 20), (13, 9, 20), (1.0, 0.95, 0.94)),  # chin
        ((0, 50, 30), (40, 24, 40), (1.01, 1.005, 0.99)),  # forehead
        ((17, 1, 15), (6, 9, 14), (0.94, 0.87, 0.87)),  # inner corners of the eyes
        ((30, -14, 15), (14, 5, 14), (0.97, 0.93, 0.93)),  # under the eyes
    ),
    lips=(0.72, 0.40, 0.375), lip_strength=0.8, n_freckles=70,
    lid_line=(0.34, 0.25, 0.22), crease=(0.90, 0.79, 0.75), waterline=(0.80, 0.60, 0.57),
    hair=(0.17, 0.105, 0.07), hair_tip=(0.27, 0.17, 0.11), brows=(0.25, 0.16, 0.11), lashes=(0.09, 0.06, 0.05),
    iris_dark=(0.16, 0.11, 0.06), iris=(0.34, 0.24, 0.13), iris_light=(0.52, 0.39, 0.22), iris_rim=(0.10, 0.07, 0.04),
    sclera=(0.88, 0.855, 0.83), teeth=(0.91, 0.865, 0.79), cloth=(0.22, 0.34, 0.40),
)  # fmt: skip
HIS_PALETTE = replace(
    DRAWN_MAN,
    skin=(0.66, 0.47, 0.37), ears=(1.0, 0.94, 0.92), lids=(0.96, 0.91, 0.89),
    tints=(
        ((38, -32, 14), (20, 15, 30), (1.02, 0.93, 0.92)),
        ((0, -40, 40), (12, 10, 16), (1.0, 0.93, 0.92)),
        ((0, 50, 30), (40, 24, 40), (1.01, 1.005, 0.99)),
        ((17, 1, 15), (6, 9, 14), (0.93, 0.87, 0.87)),
        ((30, -14, 15), (14, 5, 14), (0.96, 0.92, 0.93)),
        ((0, -92, 10), (46, 26, 36), (0.70, 0.72, 0.78)),  # a shaven jaw
        ((0, -56, 36), (22, 6, 14), (0.78, 0.79, 0.84)),  # and lip
    ),
    lips=(0.60, 0.36, 0.31), lip_strength=0.7,
    lid_line=(0.45, 0.36, 0.32), crease=(0.90, 0.80, 0.76), waterline=(0.80, 0.60, 0.57), tear_line=0.75,
    hair=(0.095, 0.065, 0.052), hair_tip=(0.15, 0.10, 0.08), brows=(0.11, 0.075, 0.06), lashes=(0.08, 0.055, 0.045),
    iris_dark=(0.09, 0.055, 0.03), iris=(0.22, 0.13, 0.07), iris_light=(0.40, 0.25, 0.13), iris_rim=(0.05, 0.03, 0.02),
    sclera=(0.86, 0.835, 0.81), teeth=(0.89, 0.84, 0.76), cloth=(0.34, 0.37, 0.40),
)  # fmt: skip
# Her left side: behind, before the ear, and along the cheek; the rest of her hair is a bob's that has grown.
HER_LEFT = (
    Lock(
        path=((110, 78, 6), (118, 50, 10), (122, 14, 11), (122, -14, 12), (120, -38, 12), (112, -55, 6)),
        half_width=29, thickness=9, tip=1.2, bluntness=0.35,
    ),
    Lock(
        path=((46, 73, -1), (64, 58, 8), (84, 38, 11), (97, 14, 12), (103, -10, 12), (103, -34, 12), (96, -52, 9)),
        half_width=27, thickness=9, tip=1.15, bluntness=0.2,
    ),
    Lock(
        path=((36, 62, -1), (48, 53, 6), (66, 40, 9), (82, 22, 10), (90, 0, 10), (91, -30, 10), (86, -50, 6)),
        half_width=22, thickness=8, tip=1.1, bluntness=0.1,
    ),
    Lock(
        path=((30, 51, -1), (40, 43, 4), (54, 33, 6), (67, 18, 7), (76, 0, 8), (79, -28, 9), (74, -46, 6)),
        half_width=16, thickness=7, tip=1.1, bluntness=0.1,
    ),
    Lock(
        path=((36, 46, -1), (46, 36, 3), (57, 22, 5), (66, 6, 6), (71, -14, 7), (71, -30, 7)),
        half_width=9, thickness=5, bluntness=0.1, clearance=2.0,
    ),
)  # fmt: skip
HER_ENDS = ((0, -62, 14), (-1, -80, 24), (-3, -94, 27))
HER_HAIR = Hairstyle(
    name="lob",
    locks=tuple(
        replace(lay_closer(grow(comb(lock, 0.62), *HER_ENDS), 4.0), ridges=5, thickness=0.75 * lock.thickness)
        for lock in (*LOCKS[:4], *HER_LEFT, *LOCKS[10:])
    ),
    hairline=HAIRLINE,
    shell_lift=5.0,
)
_COMBED_BACK = tuple(
    Lock(
        path=(
            (turn, low, -3), (1.04 * turn, 45, 4), (1.15 * turn, 56, 7), (high, 74, 8),
            (side * (180 - abs(turn)), 76, 9), (side * (180 - 0.8 * abs(turn)), 56, 6),
            (side * (180 - 0.75 * abs(turn)), 38, 1),
        ),
        half_width=17, thickness=7, root=0.75, tip=1.1, ridges=4, loose=0.0,
    )
    for side, turn, low, high in (
        (-1, -46, 31, -69), (1, 46, 31, 69), (-1, -30, 34, -45), (1, 30, 34, 45), (-1, -15, 37, -22.5), (1, 16, 37, 24),
        (1, 1, 37, 1.5),
    )
)  # fmt: skip
_SIDES = tuple(
    Lock(
        path=tuple((side * turn, up, lift) for turn, up, lift in path),
        half_width=width, thickness=6, root=0.8, ridges=4, loose=0.0,
    )
    for path, width in (
        (((44, 34, -3), (54, 40, 3), (74, 45, 6), (104, 44, 6), (132, 34, 1)), 15),
        (((42, 42, -3), (56, 49, 4), (80, 57, 7), (110, 57, 7), (140, 42, 1)), 18),
    )
    for side in (1, -1)
)  # fmt: skip
_HIS_SIDE = tuple((turn, height - 3 * (turn < 45)) for turn, height in SIDE)
HIS_HAIR = Hairstyle(
    name="crew",
    locks=tuple(lay_closer(lock, 7.0, root_mm=9.0, root_deg=2.0) for lock in (*_COMBED_BACK, *_SIDES)),
    hairline=(*((-turn, height) for turn, height in reversed(_HIS_SIDE[1:])), *_HIS_SIDE),
    shell_lift=3.2,
    fade=22.0,
)
REALISTIC_WOMAN = DrawnCharacter(
    name="mara",
    summary="a woman of about thirty with brown hair to her shoulders, in film light",
    targets=person_targets("mara"),
    proportions=Proportions(drawn=DRAWN),
    palette=HER_PALETTE,
    eyes=EyeStyle(iris=0.42, pupil=0.155, bulge=0.02),
    brow=Brow(
        line=((11, 18.6), (22, 21.6), (34, 24.6), (44, 24), (52, 19.5)),
        half_width=((0, 2.0), (0.08, 2.8), (0.3, 3.0), (0.6, 2.3), (0.85, 1.3), (1, 0.3)),
        hairs=330,
    ),
    lashes=((0, 0.2), (0.2, 1.2), (0.5, 2.4), (0.8, 3.2), (0.92, 3.6), (1, 3.4)),
    hair=HER_HAIR,
    collar=Collar(
        across=62, ahead=44, behind=60, front=-158, back=-122, middle=-66, half_width=4, half_height=12, tilt=-20
    ),
    rest={"mouthSmile": 0.42, "cheekSquint": 0.18, "eyeSquint": 0.12, "eyeBlink": 0.06, "mouthDimple": 0.06},
    teeth_back=1.5,
    seams=SEAMS,
)
REALISTIC_MAN = DrawnCharacter(
    name="tomas",
    summary="a man of about thirty-five with short brown hair, in film light",
    targets=person_targets("tomas"),
    proportions=Proportions(drawn=DRAWN),
    palette=HIS_PALETTE,
    eyes=EyeStyle(iris=0.415, pupil=0.155, bulge=0.02),
    brow=Brow(
        line=((10, 17.6), (22, 20.4), (34, 22.6), (45, 21.5), (53, 16.5)),
        half_width=((0, 2.6), (0.08, 3.4), (0.3, 3.8), (0.6, 3.2), (0.85, 2.0), (1, 0.5)),
        hairs=340,
    ),
    lashes=((0, 0.1), (0.2, 0.6), (0.5, 1.2), (0.8, 1.6), (1, 1.2)),
    hair=HIS_HAIR,
    collar=None,
    rest={"mouthSmile": 0.34, "cheekSquint": 0.14, "eyeSquint": 0.2, "eyeBlink": 0.06, "mouthDimple": 0.05},
    seams=SEAMS,
)
