"""The drawn elder: silver hair in a bun, round glasses, a wine-red collar."""

from dataclasses import replace

from corpus_tools.shipped.drawn.character import Brow, Collar, DrawnCharacter, Hairstyle, Lock, Proportions
from corpus_tools.shipped.drawn.woman import PALETTE as HER_PALETTE
from corpus_tools.shipped.head.eyes import EyeStyle
from corpus_tools.shipped.head.proportions import person_targets

PALETTE = replace(
    HER_PALETTE,
    skin=(0.83, 0.62, 0.485), ears=(1.0, 0.93, 0.92), lids=(0.98, 0.92, 0.90),
    tints=(
        ((38, -36, 14), (16, 13, 30), (1.03, 0.84, 0.82)),
        ((0, -34, 40), (12, 10, 14), (1.03, 0.88, 0.86)),
        ((0, 45, 30), (40, 22, 40), (1.02, 1.01, 1.0)),
        ((16, 0, 12), (7, 10, 14), (0.94, 0.86, 0.85)),
        ((34, -20, 20), (20, 6, 26), (0.96, 0.90, 0.89)),  # under the eyes
    ),
    lips=(0.72, 0.40, 0.38), lip_strength=0.70, n_freckles=0,
    lid_line=(0.42, 0.34, 0.32), crease=(0.84, 0.72, 0.69),
    hair=(0.68, 0.665, 0.66), hair_tip=(0.80, 0.785, 0.77),
    brows=(0.50, 0.475, 0.46), lashes=(0.20, 0.16, 0.15),
    iris_dark=(0.07, 0.05, 0.035), iris=(0.20, 0.14, 0.09), iris_light=(0.50, 0.36, 0.22),
    iris_rim=(0.04, 0.03, 0.02), cloth=(0.50, 0.13, 0.17), tear_line=0.9,
)  # fmt: skip
BUN = Lock(
    path=((85, 62, 20), (100, 78, 26), (-100, 78, 26), (-85, 62, 20)),
    half_width=36, thickness=33, hollow=0.8, clearance=8.0, ridges=6, is_ball=True, loose=0.12,
)  # fmt: skip
LOCKS = (
    BUN,
    *(  # swept from the hairline up to the bun
        Lock(
            path=(
                (side * turn, low, -14), (side * (turn * 0.97 + 4), low + 0.3 * (78 - low), 5),
                (side * (turn * 0.9 + 12), low + 0.65 * (80 - low), 9), (side * 120, 82, 6),
            ),
            half_width=width, thickness=7, root=0.6, tip=0.6, ridges=3, clearance=-5.0, loose=0.0,
        )
        for side in (1, -1)
        for turn, low, width in (
            (7, 34, 19), (22, 33, 18), (36, 29, 17), (50, 17, 17), (64, 4, 18), (80, -6, 20), (104, -4, 22),
            (134, -22, 26), (166, -32, 28),
        )
    ),
    Lock(
        path=((180, -36, -14), (180, 0, 6), (180, 45, 10), (180, 80, 6)),
        half_width=22, thickness=7, root=0.6, tip=0.6, ridges=3, clearance=-5.0, loose=0.0,
    ),
)  # fmt: skip
SIDE = (
    (0, 34), (15, 35), (30, 33), (42, 26), (52, 16), (62, 6), (72, -4), (80, -10), (88, -6), (98, -2), (108, -12),
    (124, -24), (150, -34), (180, -36),
)  # fmt: skip
ELDER = DrawnCharacter(
    name="noor",
    summary="an old woman with silver hair in a bun, drawn as for an animated film",
    targets=person_targets("noor"),
    proportions=Proportions(
        eye_gain=0.72, eye_reach=34.0, nose_gain=-0.30, lips_thinner=0.26, lips_back=2.8, jaw_taper=0.10, chin_up=10.0,
        chin_forward=3.0, upper_cheek=4.0, lower_cheek=4.4, corners_up=4.4, middle_down=0.4, skull_gain=0.08,
        neck_thinner=0.14,
    ),
    palette=PALETTE,
    eyes=EyeStyle(iris=0.50, pupil=0.22, colour=(0.46, 0.25, 0.10), bulge=0.02),
    brow=Brow(
        line=((11, 28.5), (21, 32.0), (33, 33.0), (44, 30.0), (52, 24.0)),
        half_width=((0, 0.6), (0.06, 2.2), (0.2, 3.0), (0.5, 2.9), (0.8, 1.9), (1, 0.3)),
        thickness=((0, 0.4), (0.12, 1.2), (0.4, 1.6), (0.8, 1.0), (1, 0.2)),
    ),
    lashes=((0, 0.1), (0.2, 0.7), (0.5, 1.5), (0.8, 2.1), (1, 2.4)),
    hair=Hairstyle(
        name="bun",
        locks=LOCKS,
        hairline=(*((-turn, height) for turn, height in reversed(SIDE[1:])), *SIDE),
        shell_lift=6.0,
    ),
    collar=Collar(
        across=56, ahead=46, behind=64, front=-146, back=-115, middle=-68, half_width=8.0, half_height=14, tilt=-14
    ),
    rest={"mouthSmile": 0.36, "cheekSquint": 0.20, "eyeSquint": 0.26, "eyeBlink": 0.06},
    still_lip=0.75,
    pucker=1.45,
    teeth_back=2.0,
    has_studs=True,
    glasses=(0.62, 0.42, 0.20),
)  # fmt: skip
