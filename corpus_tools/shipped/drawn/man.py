"""The drawn man: a dark quiff over short sides, brown eyes, a terracotta collar."""

from dataclasses import replace

from corpus_tools.shipped.drawn.character import Brow, Collar, DrawnCharacter, Hairstyle, Lock, Proportions
from corpus_tools.shipped.drawn.woman import PALETTE as HER_PALETTE
from corpus_tools.shipped.drawn.woman import WOMAN
from corpus_tools.shipped.head.eyes import EyeStyle
from corpus_tools.shipped.head.proportions import person_targets

PALETTE = replace(
    HER_PALETTE,
    skin=(0.60, 0.415, 0.32), ears=(1.0, 0.95, 0.93), lids=(1.0, 0.95, 0.94),
    tints=(
        ((37, -30, 14), (17, 13, 30), (1.03, 0.94, 0.93)),
        ((0, -34, 40), (12, 10, 14), (1.03, 0.95, 0.94)),
        ((0, 45, 30), (40, 22, 40), (1.03, 1.02, 1.0)),
        ((16, 0, 12), (7, 10, 14), (0.95, 0.88, 0.87)),
        ((0, -86, 10), (46, 22, 34), (0.90, 0.90, 0.92)),  # a shaven jaw
    ),
    lips=(0.64, 0.35, 0.30), lip_strength=0.60, n_freckles=0, cavity=(0.42, 0.13, 0.14),
    lid_line=(0.30, 0.22, 0.19), crease=(0.86, 0.76, 0.72),
    hair=(0.125, 0.085, 0.075), hair_tip=(0.19, 0.13, 0.11),
    brows=(0.10, 0.065, 0.055), lashes=(0.09, 0.055, 0.045),
    iris_dark=(0.10, 0.055, 0.03), iris=(0.27, 0.14, 0.065), iris_light=(0.62, 0.36, 0.15),
    iris_rim=(0.05, 0.028, 0.018), cloth=(0.90, 0.43, 0.33), tear_line=0.62,
)  # fmt: skip
LOCKS = (
    *(  # combed back to the crown
        Lock(
            path=(
                (turn, 50, 0), (turn * 1.05, 62, 9), (turn * 1.3, 76, 12), (180 - turn * 0.95, 78, 10),
                (180 - turn * 0.8, 58, 7), (180 - turn * 0.75, 40, 2),
            ),
            half_width=24, thickness=8, root=0.8, tip=1.1, loose=0.0,
        )
        for turn in (-58, 58, -28, 30, 2)
    ),
    # sides of the top
    Lock(
        path=((36, 34, -3), (48, 39, 5), (72, 44, 8), (100, 42, 7), (130, 34, 2)),
        half_width=16, thickness=7, root=0.8, loose=0.0,
    ),
    Lock(
        path=((-40, 34, -3), (-52, 39, 5), (-74, 44, 8), (-102, 42, 7), (-130, 34, 2)),
        half_width=16, thickness=7, root=0.8, loose=0.0,
    ),
    # between the sides and what is combed back
    *(
        Lock(
            path=(
                (side * 42, 42, -3), (side * 56, 48, 4), (side * 80, 56, 8), (side * 110, 56, 7), (side * 140, 42, 2),
            ),
            half_width=20, thickness=7, root=0.8, loose=0.0,
        )
        for side in (1, -1)
    ),
    # the quiff: broad locks rise from the front hairline and roll over to his left, those behind first
    Lock(
        path=((-46, 33, -4), (-43, 41, 6), (-30, 58, 14), (0, 71, 16), (52, 74, 12), (84, 62, 5)),
        half_width=22, thickness=9, root=0.34, clearance=0.5, ridges=1, loose=0.2,
    ),
    Lock(
        path=((-30, 34, -4), (-25, 42, 9), (-10, 58, 20), (20, 67, 20), (54, 64, 14), (74, 52, 5)),
        half_width=24, thickness=11, root=0.34, clearance=0.5, ridges=1, loose=0.2,
    ),
    Lock(
        path=((-8, 34, -4), (-2, 42, 11), (14, 55, 23), (36, 60, 22), (56, 54, 14), (66, 43, 5)),
        half_width=24, thickness=12, root=0.34, clearance=0.5, ridges=1, loose=0.2,
    ),
    Lock(
        path=((15, 34, -4), (20, 41, 8), (31, 48, 16), (44, 50, 15), (55, 43, 9), (61, 35, 4)),
        half_width=18, thickness=10, root=0.34, clearance=0.5, ridges=1, loose=0.2,
    ),
    Lock(
        path=((30, 33, -3), (35, 38, 5), (43, 42, 8), (51, 38, 6), (56, 31, 3)),
        half_width=10, thickness=6, root=0.34, clearance=0.5, ridges=1, loose=0.2,
    ),
)  # fmt: skip
SIDE = (
    (0, 37), (15, 37), (30, 37), (42, 33), (50, 25), (56, 14), (61, 2), (66, -11), (72, -17), (80, -18), (90, -16),
    (105, -18), (120, -24), (150, -32), (180, -34),
)  # fmt: skip
MAN = DrawnCharacter(
    name="ben",
    summary="a young man with a dark quiff, drawn as for an animated film",
    targets=person_targets("ben"),
    proportions=Proportions(
        eye_gain=0.90, eye_reach=34.0, nose_gain=-0.28, lips_thinner=0.26, lips_back=2.4, jaw_taper=0.15, chin_up=11.0,
        chin_forward=4.0, upper_cheek=2.0, lower_cheek=0.8, corners_up=4.2, middle_down=0.4, skull_gain=0.05,
        neck_thinner=0.06, jaw=4.0,
    ),
    palette=PALETTE,
    eyes=EyeStyle(iris=0.515, pupil=0.24, colour=(0.46, 0.25, 0.10), bulge=0.02),
    brow=Brow(
        line=((10.5, 25.5), (22, 29.5), (34, 31.5), (45, 29), (53, 23)),
        half_width=((0, 1.2), (0.06, 3.4), (0.2, 4.4), (0.5, 4.3), (0.8, 2.9), (1, 0.5)),
        thickness=((0, 0.5), (0.12, 1.4), (0.4, 1.8), (0.8, 1.1), (1, 0.3)),
    ),
    lashes=((0, 0.1), (0.2, 0.7), (0.5, 1.3), (0.8, 1.7), (1, 1.2)),
    hair=Hairstyle(
        name="quiff",
        locks=LOCKS,
        hairline=(*((-turn, height) for turn, height in reversed(SIDE[1:])), *SIDE),
        shell_lift=3.2,
        fade=16.0,
    ),
    collar=Collar(
        across=60, ahead=44, behind=62, front=-152, back=-117, middle=-73, half_width=8.5, half_height=19, tilt=-16
    ),
    rest=WOMAN.rest,
    pucker=1.45,
)  # fmt: skip
