"""Presets of age, sex and ancestry: MakeHuman's macro targets, with hair and tints of skin, brows and eyes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from corpus_tools.head.cage import build_cage
from corpus_tools.head.cards import CardChoice
from corpus_tools.head.head import HeadStyle, ReferenceHead, assemble_head
from corpus_tools.head.piece import HeadPieces, stack_vertices
from corpus_tools.head.source import SourceMesh
from tts2face.models.face import Hairdo
from tts2face.models.face_file import Identity

Tint = tuple[float, float, float]
PLAIN: Tint = (1.0, 1.0, 1.0)
FRIENDLY: Mapping[str, float] = {
    "mouth/mouth-angles-up": 0.35, "eyebrows/eyebrows-trans-up": 0.25, "eyebrows/eyebrows-angle-up": 0.2,
}  # fmt: skip
OPEN_BROWS: Mapping[str, float] = {  # angle-up lowers the outer half of the brow
    **FRIENDLY, "mouth/mouth-angles-up": 0.4, "eyebrows/eyebrows-trans-up": 0.6, "eyebrows/eyebrows-angle-up": 0.5,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Preset:
    """A preset: sex and age in MakeHuman's terms, shares of ancestry, haircut with colour, tints, and a summary.

    ``more`` are further targets, ``brows`` the set of brows.
    """

    summary: str
    sex: str
    ages: Mapping[str, float]
    ancestry: Mapping[str, float]
    hairdo: Hairdo
    skin: Tint = PLAIN
    brow: Tint = PLAIN
    iris: Tint = PLAIN
    shirt: Tint = PLAIN
    brows: str = ""
    sclera: Tint = PLAIN
    more: Mapping[str, float] = field(default_factory=lambda: FRIENDLY)

    def targets(self) -> dict[str, float]:
        """Weight of each MakeHuman target."""
        found = dict(self.more)
        for age, share in self.ages.items():
            found[f"macrodetails/universal-{self.sex}-{age}-averagemuscle-averageweight"] = share
            for ancestry, part in self.ancestry.items():
                found[f"macrodetails/{ancestry}-{self.sex}-{age}"] = share * part
        return found

    def cards(self) -> CardChoice:
        """Fuller brows and sparser lashes for men."""
        is_male = self.sex == "male"
        return CardChoice(
            self.brows or ("eyebrow012" if is_male else "eyebrow001"), "eyelashes01" if is_male else "eyelashes02"
        )


BROWN, DARK = (0.66, 0.46, 0.33), (0.42, 0.28, 0.20)  # eyes; the iris in the texture is light
BLACK, BLOND, GREY = (0.42, 0.43, 0.47), (1.9, 2.0, 1.75), (2.1, 2.8, 3.4)  # brows
DARK_SCLERA = (0.93, 0.905, 0.86)
YOUNG, OLD, CHILD = {"young": 1.0}, {"old": 1.0}, {"child": 0.85, "young": 0.15}
PRESETS: dict[str, Preset] = {
    "erik": Preset(
        "man, about 30, European", "male", YOUNG, {"caucasian": 1}, Hairdo("short02", "dark-blond"),
        (0.98, 0.95, 0.93), BLOND, (0.85, 0.93, 1.02), (1.2, 0.9, 0.8), more=OPEN_BROWS,
    ),
    "amara": Preset(
        "woman, about 30, West African", "female", YOUNG, {"african": 1}, Hairdo("afro01", "black"),
        (0.51, 0.50, 0.465), BLACK, DARK, (2.6, 1.5, 0.7), sclera=DARK_SCLERA,
    ),
    "kofi": Preset(
        "man, about 35, West African", "male", {"young": 0.85, "old": 0.15}, {"african": 1},
        Hairdo("short04", "black"), (0.43, 0.43, 0.405), BLACK, DARK, brows="eyebrow008", sclera=DARK_SCLERA,
        more=OPEN_BROWS,
    ),
    "mei": Preset(
        "woman, about 28, East Asian", "female", YOUNG, {"asian": 1}, Hairdo("long01", "black"),
        (1.01, 0.99, 0.94), BLACK, DARK, (2.8, 1.2, 1.1), "eyebrow010",
    ),
    "kenji": Preset(
        "man, about 40, East Asian", "male", {"young": 0.75, "old": 0.25}, {"asian": 1}, Hairdo("short01", "black"),
        (0.95, 0.91, 0.86), BLACK, DARK, brows="eyebrow008",
    ),
    "leila": Preset(
        "woman, about 35, mixed ancestry", "female", {"young": 0.85, "old": 0.15},
        {"caucasian": 0.45, "african": 0.3, "asian": 0.25}, Hairdo("ponytail01", "dark-brown"),
        (0.80, 0.80, 0.76), BLACK, BROWN, (1.2, 2.0, 1.3), "eyebrow010", sclera=DARK_SCLERA,
    ),
    "ravi": Preset(
        "man, about 30, mixed ancestry", "male", YOUNG, {"caucasian": 0.5, "african": 0.2, "asian": 0.3},
        Hairdo("short02", "black"), (0.69, 0.68, 0.62), BLACK, DARK, (1.7, 1.7, 1.6), sclera=DARK_SCLERA,
        more=OPEN_BROWS,
    ),
    "ingrid": Preset(
        "woman, about 70, European", "female", OLD, {"caucasian": 1}, Hairdo("bob02", "white"),
        (1.0, 0.965, 0.955), GREY, PLAIN, (2.0, 0.8, 1.1),
    ),
    "walter": Preset(
        "man, about 65, European", "male", OLD, {"caucasian": 1}, Hairdo("cropped", "#6e6862"),
        (0.98, 0.93, 0.91), GREY, more={**OPEN_BROWS, "mouth/mouth-angles-up": 0.7},
    ),
    "nia": Preset(
        "child, about 9, mixed ancestry", "female", CHILD, {"caucasian": 0.4, "african": 0.4, "asian": 0.2},
        Hairdo("braid01", "black"), (0.79, 0.78, 0.735), BLACK, BROWN, (3.2, 2.4, 0.7),
    ),
}  # fmt: skip


def build_identities(
    source: SourceMesh, reference: ReferenceHead, style: HeadStyle, default: HeadPieces
) -> dict[str, Identity]:
    """Each preset as a displacement of the default head."""
    rest = stack_vertices(default)
    found = {}
    for name, person in PRESETS.items():
        own_style = replace(style, cards=person.cards())
        own = stack_vertices(assemble_head(build_cage(source, person.targets()), reference, own_style))
        tints = {
            "skin": person.skin, "brows": person.brow, "iris": person.iris, "sclera": person.sclera,
            "shirt": person.shirt, "gums_upper": _dampen_tint(person.skin), "gums_lower": _dampen_tint(person.skin),
        }  # fmt: skip
        found[name] = Identity((own - rest).astype(np.float32), tints, person.summary, person.hairdo)
    return found


def _dampen_tint(tint: Tint) -> Tint:
    red, green, blue = (0.6 + 0.4 * part for part in tint)
    return red, green, blue
