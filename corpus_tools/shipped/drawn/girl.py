"""The drawn girl: two puffs of curls, dark brown skin, a lilac collar."""

from dataclasses import replace

from corpus_tools.shipped.drawn.character import Brow, Collar, DrawnCharacter, Hairstyle, Lock, Proportions
from corpus_tools.shipped.drawn.woman import PALETTE as HER_PALETTE
from corpus_tools.shipped.head.eyes import EyeStyle
from corpus_tools.shipped.head.proportions import person_targets

PALETTE = replace(
    HER_PALETTE,
    skin=(0.47, 0.30, 0.215), ears=(1.0, 0.95, 0.93), lids=(1.0, 0.95, 0.94),
    tints=(
        ((36, -32, 14), (17, 13, 30), (1.06, 0.90, 0.88)),
        ((0, -32, 40), (11, 9, 14), (1.05, 0.93, 0.92)),
        ((0, 45, 30), (40, 22, 40), (1.04, 1.03, 1.0)),
        ((16, 0, 12), (7, 10, 14), (0.95, 0.90, 0.88)),
    ),
    lips=(0.56, 0.30, 0.27), lip_strength=0.55, n_freckles=0, cavity=(0.40, 0.12, 0.13),
    lid_line=(0.28, 0.22, 0.20), crease=(0.84, 0.76, 0.72), waterline=(0.80, 0.62, 0.58),
    hair=(0.085, 0.060, 0.052), hair_tip=(0.15, 0.105, 0.085),
    brows=(0.07, 0.048, 0.042), lashes=(0.06, 0.04, 0.035),
    iris_dark=(0.08, 0.042, 0.024), iris=(0.23, 0.125, 0.065), iris_light=(0.56, 0.34, 0.17),
    iris_rim=(0.04, 0.022, 0.015), cloth=(0.60, 0.47, 0.80), tear_line=0.55,
)  # fmt: skip
PUFFS = tuple(
    Lock(
        path=((side * 26, 44, 16), (side * 42, 56, 25), (side * 68, 59, 26), (side * 92, 50, 17)),
        half_width=39, thickness=36, hollow=0.9, clearance=14.0, is_ball=True, curls=2.4, loose=0.35,
    )
    for side in (1, -1)
)  # fmt: skip
LOCKS = (
    *PUFFS,
    *(  # combed up to the puffs from all around the hairline
        Lock(
            path=(
                (side * turn, low, -4), (side * (0.8 * turn + 12), low + 0.35 * (52 - low), 4),
                (side * (0.4 * turn + 34), low + 0.7 * (52 - low), 6), (side * 58, 52, 5),
            ),
            half_width=width, thickness=5, root=0.3, tip=0.5, ridges=3, clearance=-4.0, loose=0.0,
        )
        for side in (1, -1)
        for turn, low, width in (
            (5, 36, 13), (19, 33, 13), (33, 29, 12), (46, 20, 12), (60, 8, 13), (76, -2, 14), (98, 0, 15),
            (122, -14, 17), (148, -24, 18),
        )
    ),
)  # fmt: skip
SIDE = (
    (0, 31), (12, 32), (26, 31), (38, 27), (48, 20), (58, 11), (66, 3), (74, -5), (84, -6), (96, -2), (108, -12),
    (124, -24), (150, -33), (180, -35),
)  # fmt: skip
GIRL = DrawnCharacter(
    name="zuri",
    summary="a girl with two puffs of curls, drawn as for an animated film",
    targets=person_targets("zuri"),
    proportions=Proportions(
        eye_gain=1.00, eye_reach=36.0, nose_gain=-0.44, lips_thinner=0.40, lips_back=4.2, jaw_taper=0.20, chin_up=16.0,
        chin_forward=2.0, upper_cheek=3.4, lower_cheek=4.2, corners_up=4.2, middle_down=0.0, skull_gain=0.12,
        neck_thinner=0.34,
    ),
    palette=PALETTE,
    eyes=EyeStyle(iris=0.53, pupil=0.25, colour=(0.46, 0.25, 0.10), bulge=0.02),
    brow=Brow(
        line=((13, 31.0), (23, 34.6), (34, 36.2), (44, 34.4), (52, 29.5)),
        half_width=((0, 0.5), (0.08, 2.0), (0.25, 2.9), (0.5, 2.8), (0.8, 1.7), (1, 0.25)),
        thickness=((0, 0.3), (0.12, 0.8), (0.4, 1.1), (0.8, 0.7), (1, 0.2)),
    ),
    lashes=((0, 0.2), (0.12, 0.8), (0.4, 1.9), (0.7, 2.6), (0.88, 3.4), (1, 4.6)),
    hair=Hairstyle(
        name="puffs",
        locks=LOCKS,
        hairline=(*((-turn, height) for turn, height in reversed(SIDE[1:])), *SIDE),
        shell_lift=3.5,
    ),
    collar=Collar(
        across=50, ahead=46, behind=60, front=-134, back=-110, middle=-64, half_width=8.5, half_height=13, tilt=-12
    ),
    rest={"mouthSmile": 0.27, "cheekSquint": 0.14, "eyeSquint": 0.14, "eyeBlink": 0.03},
)  # fmt: skip
