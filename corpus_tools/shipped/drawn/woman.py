"""The drawn woman: a side-swept chestnut bob, green eyes, a yellow collar.

Measures that looked right, and what looked wrong beside them, are in docs/decisions/161-drawn.md.
"""

from corpus_tools.shipped.drawn.character import (
    Brow,
    CharacterColours,
    Collar,
    DrawnCharacter,
    Hairstyle,
    Lock,
    Proportions,
)
from corpus_tools.shipped.head.eyes import EyeStyle
from corpus_tools.shipped.head.proportions import person_targets

# Rosy rather than yellow skin, as the warm key light adds the yellow. The hair is two values darker than the skin, as
# auburn has its value and hue; the green of the eyes is the hair's complement, and an echo of the wall.
PALETTE = CharacterColours(
    skin=(0.89, 0.665, 0.55), ears=(1.0, 0.94, 0.93), lids=(1.0, 0.95, 0.93),
    tints=(
        ((36, -32, 14), (17, 13, 30), (1.04, 0.80, 0.80)),  # cheeks
        ((0, -32, 40), (11, 9, 14), (1.04, 0.86, 0.85)),  # nose
        ((0, -90, 20), (12, 9, 20), (1.02, 0.93, 0.93)),  # chin
        ((0, 45, 30), (40, 22, 40), (1.03, 1.02, 1.0)),  # forehead
        ((16, 0, 12), (7, 10, 14), (0.96, 0.88, 0.87)),  # inner corners of the eyes
    ),
    lips=(0.85, 0.47, 0.45), lip_strength=0.82, n_freckles=46, cavity=(0.52, 0.17, 0.19),
    lid_line=(0.26, 0.18, 0.16), crease=(0.88, 0.74, 0.70), waterline=(0.72, 0.52, 0.50),
    hair=(0.26, 0.125, 0.085), hair_tip=(0.38, 0.19, 0.115),
    brows=(0.33, 0.18, 0.12), lashes=(0.13, 0.07, 0.055),
    iris_dark=(0.05, 0.12, 0.10), iris=(0.15, 0.31, 0.25), iris_light=(0.49, 0.68, 0.48), iris_rim=(0.03, 0.07, 0.06),
    cloth=(0.93, 0.66, 0.25),
)  # fmt: skip
LOCKS = (
    # behind
    Lock(
        path=((180, 74, 5), (-150, 50, 9), (-140, 16, 12), (-136, -18, 14), (-132, -40, 13), (-126, -58, 2)),
        half_width=34, thickness=9, tip=1.2, bluntness=0.35,
    ),
    Lock(
        path=((168, 70, 3), (178, 48, 7), (-176, 14, 9), (-170, -20, 11), (-166, -42, 10), (-160, -58, 0)),
        half_width=34, thickness=8, tip=1.2, bluntness=0.35,
    ),
    Lock(
        path=((150, 74, 5), (150, 46, 9), (152, 12, 12), (158, -18, 14), (163, -40, 13), (168, -57, 2)),
        half_width=34, thickness=9, tip=1.2, bluntness=0.35,
    ),
    Lock(
        path=((128, 76, 5), (124, 48, 9), (122, 12, 11), (124, -20, 13), (122, -42, 12), (108, -58, 4)),
        half_width=36, thickness=9, tip=1.2, bluntness=0.35,
    ),
    # her left, tucked behind the ear
    Lock(
        path=((110, 78, 6), (118, 50, 10), (124, 14, 11), (126, -14, 12), (124, -38, 12), (116, -55, 6)),
        half_width=29, thickness=9, tip=1.2, bluntness=0.35,
    ),
    Lock(
        path=(
            (46, 73, -1), (64, 58, 8), (84, 38, 11), (101, 14, 12), (113, -10, 12), (115, -34, 12), (102, -52, 9),
        ),
        half_width=25, thickness=9, tip=1.15, bluntness=0.2,
    ),
    Lock(
        path=((30, 61, -1), (44, 51, 6), (60, 38, 9), (78, 22, 9), (94, 9, 8), (106, -4, 4), (113, -18, -1)),
        half_width=17, thickness=8, tip=1.1, bluntness=0.1,
    ),
    Lock(
        path=((29, 50, -1), (39, 42, 4), (51, 29, 6), (65, 17, 7), (80, 8, 7), (92, 2, 6)),
        half_width=10.5, thickness=6, bluntness=0.1,
    ),
    Lock(
        path=((36, 46, 0), (50, 26, 4), (60, 10, 4), (67, -4, 4), (70, -17, 4), (66, -29, 4)),
        half_width=5.5, thickness=4, clearance=1.5,
    ),
    # along the hairline of the bare temple
    Lock(
        path=((60, 33, 0), (75, 23, 2), (87, 13, 3), (97, 4, 3), (105, -5, 2), (112, -16, 0)),
        half_width=8.5, thickness=4, bluntness=0.1, clearance=1.5, loose=0.3,
    ),
    # under the part and the crown
    Lock(
        path=((31, 43, -6), (34, 52, -4), (42, 66, -3), (90, 80, -1), (170, 74, 0)),
        half_width=16, thickness=6, tip=1.3, root=0.8,
    ),
    Lock(
        path=((60, 70, 1), (110, 76, 3), (150, 66, 4), (165, 50, 3)),
        half_width=26, thickness=7, tip=1.2, root=0.9,
    ),
    # her right: first a flat lock that fills the hollow under the sweep, then the sweep
    Lock(
        path=((26, 46, -1), (14, 42, 2), (-8, 33, 3), (-30, 20, 3), (-46, 8, 3)),
        half_width=17, thickness=5, root=0.8, hollow=0.8,
    ),
    Lock(
        path=(
            (80, 74, 0), (-100, 82, 9), (-106, 52, 12), (-108, 16, 12), (-109, -16, 13), (-103, -36, 12), (-82, -53, 5),
        ),
        half_width=34, thickness=9, tip=1.2, bluntness=0.35,
    ),
    Lock(
        path=(
            (56, 67, -1), (30, 71, 7), (-10, 70, 12), (-62, 50, 13), (-84, 16, 14), (-88, -14, 14), (-80, -37, 12),
            (-62, -54, 5),
        ),
        half_width=31, thickness=9, tip=1.2, bluntness=0.25, root=0.8,
    ),
    Lock(
        path=(
            (47, 60, -1), (30, 61, 6), (4, 58, 9), (-40, 42, 11), (-66, 14, 11), (-73, -10, 12), (-69, -31, 10),
            (-54, -48, 5),
        ),
        half_width=26, thickness=9, tip=1.1, bluntness=0.15, root=0.8,
    ),
    Lock(
        path=(
            (42, 54, -1), (29, 51, 5), (8, 43, 7), (-22, 29, 8), (-46, 10, 7), (-58, -10, 8), (-60, -25, 8),
            (-51, -40, 4),
        ),
        half_width=19, thickness=8, tip=1.1, bluntness=0.1, root=0.8, hollow=1.2,
    ),
    Lock(
        path=((37, 48, -1), (28, 43, 3), (14, 35, 5), (-8, 21, 8), (-30, 8, 7), (-46, -6, 5), (-50, -18, 3)),
        half_width=15, thickness=8, bluntness=0.1, root=0.8, hollow=1.1,
    ),
)  # fmt: skip
HAIRLINE = (  # on her right it lies under the fringe
    (-180, -36), (-150, -34), (-120, -22), (-100, -14), (-84, -8), (-70, 3), (-58, 9), (-40, 13), (-20, 21), (0, 27),
    (12, 34), (20, 41), (31, 45), (40, 37), (48, 26), (58, 17), (70, 4), (84, -8), (100, -14), (120, -22), (150, -34),
    (180, -36),
)  # fmt: skip
WOMAN = DrawnCharacter(
    name="ada",
    summary="a young woman with a chestnut bob, drawn as for an animated film",
    targets=person_targets("ada"),
    proportions=Proportions(
        eye_gain=0.92, nose_gain=-0.46, lips_thinner=0.36, lips_back=2.6, jaw_taper=0.24, chin_up=15.5,
        chin_forward=2.0, upper_cheek=3.2, lower_cheek=2.8, corners_up=4.2, middle_down=0.0, skull_gain=0.10,
        neck_thinner=0.30,
    ),
    palette=PALETTE,
    # An iris of 29 mm in an opening of 40 by 25 mm is cut by both lids; a pupil of .47 of it is friendly.
    eyes=EyeStyle(iris=0.515, pupil=0.24, colour=(0.46, 0.25, 0.10), bulge=0.02),
    brow=Brow(
        line=((12, 30.2), (23, 33.4), (35, 34.2), (46, 30.8), (54, 25.5)),  # a low flat arc
        half_width=((0, 0.5), (0.05, 2.1), (0.16, 3.1), (0.45, 3.2), (0.8, 1.9), (1, 0.25)),  # round inner end
        thickness=((0, 0.4), (0.12, 1.1), (0.4, 1.4), (0.8, 0.8), (1, 0.2)),
    ),
    lashes=((0, 0.2), (0.12, 1.0), (0.4, 2.5), (0.7, 3.3), (0.88, 4.9), (1, 7.4)),  # ends in a wing
    hair=Hairstyle(name="bob", locks=LOCKS, hairline=HAIRLINE, shell_lift=8.0),
    collar=Collar(
        across=54, ahead=50, behind=66, front=-141, back=-113, middle=-64, half_width=9, half_height=17, tilt=-14
    ),
    # .17 of a smile looks tired; lids at .11 are sleepy, at 0 startled.
    rest={"mouthSmile": 0.34, "cheekSquint": 0.16, "eyeSquint": 0.22, "eyeBlink": 0.05},
    has_studs=True,
)  # fmt: skip
