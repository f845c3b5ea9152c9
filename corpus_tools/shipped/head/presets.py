"""Presets of age, sex and ancestry: MakeHuman's macro targets, with hair and tints of skin, brows and eyes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from corpus_tools.shipped.head.cage import build_cage
from corpus_tools.shipped.head.cards import CardChoice
from corpus_tools.shipped.head.head import HeadStyle, ReferenceHead, assemble_head
from corpus_tools.shipped.head.parts import HeadPieces, stack_vertices
from corpus_tools.shipped.head.proportions import add_targets, modelling_targets
from corpus_tools.shipped.head.source import SourceMesh
from tts2face.models.face import Hairdo
from tts2face.models.face_file import FORMAT_VERSION, KIND, Identity, read_face
from tts2face.models.shape_coding import quantise
from tts2face.storage.tensors import read_tensors, write_tensors

Tint = tuple[float, float, float]
PLAIN: Tint = (1.0, 1.0, 1.0)
# Share of the skin's tint that a part takes: what is pale or wet is lit by the skin about it, and shines on dark skin.
SKIN_SHARES = {
    "skin": 1.0, "gums_upper": 0.4, "gums_lower": 0.4, "teeth_upper": 0.2, "teeth_lower": 0.25, "tongue": 0.35,
    "wet": 1.0, "sclera": 0.15,
}  # fmt: skip
BROWN, DARK = (0.85, 0.66, 0.50), (0.62, 0.44, 0.34)  # eyes; the iris in the texture is light
BLACK, BLOND = (0.42, 0.43, 0.47), (1.9, 2.0, 1.75)  # brows
FINE_BLACK, DARK_GREY = (0.3, 0.3, 0.33), (0.95, 1.25, 1.5)
RESTS = "preset_rests"  # key of the metadata of a face: weights of shapes that lie in its identities
YOUNG, OLD, CHILD = {"young": 1.0}, {"old": 1.0}, {"child": 0.85, "young": 0.15}


@dataclass(frozen=True, slots=True)
class Preset:
    """A preset: sex and age in MakeHuman's terms, shares of ancestry, haircut with colour, tints, and a summary.

    ``brows`` is the set of brows, ``rest`` the weights of shapes at rest: of brows that would look sad above a smile.
    Proportions are in `corpus_tools.shipped.head.head`.
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
    rest: Mapping[str, float] = field(default_factory=dict)

    def targets(self) -> dict[str, float]:
        """Weight of each MakeHuman target of age, sex and ancestry."""
        found = {}
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

    def tints(self) -> dict[str, Tint]:
        """Tint of each part that has one."""
        red, green, blue = self.skin
        taken: dict[str, Tint] = {
            part: (1 - share + share * red, 1 - share + share * green, 1 - share + share * blue)
            for part, share in SKIN_SHARES.items()
        }
        return taken | {"brows": self.brow, "iris": self.iris, "shirt": self.shirt}


def _brows(down: float, outer_up: float) -> dict[str, float]:
    """Weights of brows whose inner ends lie lower, and their outer ends higher."""
    weights = {"browDown": down, "browOuterUp": outer_up}
    return {f"{name}{side}": weight for name, weight in weights.items() for side in ("Left", "Right")}


PRESETS: dict[str, Preset] = {
    "erik": Preset(
        "man, about 30, European", "male", YOUNG, {"caucasian": 1}, Hairdo("short01", "light-brown"),
        (0.98, 0.95, 0.93), BLOND, (0.76, 0.93, 1.1), (1.2, 0.9, 0.8),
    ),
    "amara": Preset(
        "woman, about 30, West African", "female", YOUNG, {"african": 1}, Hairdo("afro01", "dark-brown"),
        (0.585, 0.545, 0.50), BLACK, DARK, (2.6, 1.5, 0.7),
    ),
    "kofi": Preset(
        "man, about 35, West African", "male", {"young": 0.85, "old": 0.15}, {"african": 1},
        Hairdo("cropped", "black"), (0.53, 0.49, 0.44), BLACK, DARK, brows="eyebrow008", rest=_brows(0.28, 0.1),
    ),
    "mei": Preset(
        "woman, about 28, East Asian", "female", YOUNG, {"asian": 1}, Hairdo("bob02", "#1a1412"),
        (1.0, 0.995, 0.965), FINE_BLACK, DARK, (2.8, 1.2, 1.1), rest=_brows(0.12, 0.12),
    ),
    "leila": Preset(
        "woman, about 35, mixed ancestry", "female", {"young": 0.85, "old": 0.15},
        {"caucasian": 0.45, "african": 0.3, "asian": 0.25}, Hairdo("long01", "dark-brown"),
        (0.80, 0.80, 0.76), BLACK, BROWN, (1.2, 2.0, 1.3), "eyebrow010",
    ),
    "ravi": Preset(
        "man, about 30, mixed ancestry", "male", YOUNG, {"caucasian": 0.5, "african": 0.2, "asian": 0.3},
        Hairdo("short01", "#17110e"), (0.71, 0.68, 0.615), BLACK, DARK, (1.7, 1.7, 1.6),
    ),
    "ingrid": Preset(
        "woman, about 70, European", "female", OLD, {"caucasian": 1}, Hairdo("bob02", "grey"),
        (1.0, 0.965, 0.955), DARK_GREY, (0.8, 0.9, 0.98), (2.0, 0.8, 1.1), rest=_brows(0.2, 0.06),
    ),
    "nia": Preset(
        "child, about 9, mixed ancestry", "female", CHILD, {"caucasian": 0.4, "african": 0.4, "asian": 0.2},
        Hairdo("braid01", "dark-brown"), (0.79, 0.78, 0.735), BLACK, BROWN, (3.2, 2.4, 0.7),
    ),
}  # fmt: skip


def build_identities(
    source: SourceMesh, reference: ReferenceHead, style: HeadStyle, default: HeadPieces
) -> dict[str, Identity]:
    """Each preset as a displacement of the default head."""
    rest = stack_vertices(default)
    found = {}
    for name, person in PRESETS.items():
        cage = build_cage(source, add_targets(person.targets(), modelling_targets(name)))
        own = stack_vertices(assemble_head(cage, reference, replace(style, cards=person.cards())))
        found[name] = Identity((own - rest).astype(np.float32), person.tints(), person.summary, person.hairdo)
    return found


def refresh_presets(path: Path) -> None:
    """Write summaries, tints, haircuts and shapes at rest of `PRESETS` into the head's file; the rest of it stays."""
    face = read_face(path)
    arrays, header = read_tensors(path, KIND, FORMAT_VERSION)
    applied = dict(header["metadata"].get(RESTS, {}))
    for number, (name, _, _) in enumerate(header["identities"]):
        person = PRESETS[name]
        header["identities"][number] = [name, person.tints(), person.summary]
        header["hairdos"][name] = [person.hairdo.haircut, person.hairdo.colour]
        moved = {
            shape: person.rest.get(shape, 0.0) - applied.get(name, {}).get(shape, 0.0) for shape in face.shape_names
        }
        weights = np.array(list(moved.values()), np.float32)
        if weights.any():
            step = float(arrays[f"identity{number}_step"][0])
            displacement = arrays[f"identity{number}"] * np.float32(step) + np.einsum("k,kvc->vc", weights, face.shapes)
            steps, step = quantise(displacement, step)
            arrays |= {f"identity{number}": steps, f"identity{number}_step": np.array([step], np.float32)}
        applied[name] = dict(person.rest)
    header["metadata"] = header["metadata"] | {RESTS: {name: rest for name, rest in applied.items() if rest}}
    write_tensors(path, KIND, FORMAT_VERSION, arrays, header, is_packed=True)
