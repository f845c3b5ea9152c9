"""The shipped head, its identities and haircuts from MakeHuman's data.

Presets of age, sex and ancestry: MakeHuman's macro targets, with hair and tints of skin, brows and eyes.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.shipped.head.cards import CardChoice, cards_texture
from corpus_tools.shipped.head.correspondence import TABLE, add_landmarks
from corpus_tools.shipped.head.eyes import eye_texture
from corpus_tools.shipped.head.haircut import build_haircuts
from corpus_tools.shipped.head.head import (
    REFERENCE_PERSON,
    HeadStyle,
    ReferenceHead,
    add_targets,
    assemble_head,
    build_reference,
    modelling_targets,
)
from corpus_tools.shipped.head.mesh import Cage, HeadPieces, assemble_face, build_cage, stack_vertices
from corpus_tools.shipped.head.mouth import TONGUE_UP, scatter_in_mouth
from corpus_tools.shipped.head.source import (
    PACKAGE,
    SourceMesh,
    asset_files,
    fetch_assets,
    fetch_data,
    read_picture,
    read_source,
)
from corpus_tools.shipped.head.texture import paint_texture
from corpus_tools.training.calibrate_face import calibrate_face_file
from tts2face.models.face import Face, Hairdo, Texture
from tts2face.models.face_file import Identity, write_face
from tts2face.models.hair_file import write_hair
from tts2face.picture.occlusion import bake_hair, bake_occlusion
from tts2face.processes.threads import available_cores

Tint = tuple[float, float, float]
PLAIN: Tint = (1.0, 1.0, 1.0)
# Share of the skin's tint that a part takes: what is pale or wet is lit by the skin about it, and shines on dark skin.
SKIN_SHARES = {
    "skin": 1.0, "gums_upper": 0.4, "gums_lower": 0.4, "teeth_upper": 0.2, "teeth_lower": 0.25, "tongue": 0.35,
    "wet": 1.0, "sclera": 0.15,
}  # fmt: skip


@dataclass(frozen=True, slots=True)
class Preset:
    """A preset: sex and age in MakeHuman's terms, shares of ancestry, haircut with colour, tints, and a summary.

    ``brows`` is the set of brows. Proportions are in `corpus_tools.shipped.head.head`.
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


BROWN, DARK = (0.85, 0.66, 0.50), (0.62, 0.44, 0.34)  # eyes; the iris in the texture is light
BLACK, BLOND, GREY = (0.42, 0.43, 0.47), (1.9, 2.0, 1.75), (2.1, 2.8, 3.4)  # brows
YOUNG, OLD, CHILD = {"young": 1.0}, {"old": 1.0}, {"child": 0.85, "young": 0.15}
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
        Hairdo("cropped", "black"), (0.53, 0.49, 0.44), BLACK, DARK, brows="eyebrow008",
    ),
    "mei": Preset(
        "woman, about 28, East Asian", "female", YOUNG, {"asian": 1}, Hairdo("bob01", "#1a1412"),
        (1.0, 0.995, 0.965), BLACK, DARK, (2.8, 1.2, 1.1),
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
        "woman, about 70, European", "female", OLD, {"caucasian": 1}, Hairdo("short03", "grey"),
        (1.0, 0.965, 0.955), GREY, (0.84, 0.96, 1.1), (2.0, 0.8, 1.1),
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


Floats = NDArray[np.float64]

DEFAULT_HAIRDO = Hairdo("bob02", "brown")
METADATA = {
    "licence": "CC0-1.0",
    "attribution": "MakeHuman team (hm08 mesh, targets, brows, lashes, eyes); Mika Suominen (face units)",
    "made_by": "python -m corpus_tools.shipped.make_models",
    "data": PACKAGE,
}


def shape_names(cage: Cage) -> list[str]:
    """ARKit's 52 shapes in alphabetical order, then those of this head."""
    return [*sorted(cage.units), TONGUE_UP]


@dataclass(frozen=True, slots=True, eq=False)
class Data:
    """What the faces are made from: MakeHuman's mesh, and the folder of its assets."""

    source: SourceMesh
    assets: Path


def fetch_all(cache: Path) -> Data:
    """The data, downloaded into a folder where they are missing; errors as `fetch_data` and `fetch_assets`."""
    return Data(read_source(fetch_data(cache)), fetch_assets(cache))


def head_face(data: Data) -> Face:
    """The default head, without hair."""
    return _build_default(data, reference_head(data))[0]


def reference_head(data: Data) -> ReferenceHead:
    """The head of the reference person."""
    return build_reference(build_cage(data.source, REFERENCE_PERSON), data.assets)


def default_cage(source: SourceMesh) -> Cage:
    """The cage of the default person, a woman of about 30."""
    return build_cage(source, add_targets(REFERENCE_PERSON, modelling_targets("head")))


def _build_default(data: Data, ground: ReferenceHead) -> tuple[Face, HeadPieces]:
    look = HeadStyle()
    built = assemble_head(default_cage(data.source), ground, look)
    names = shape_names(ground.cage)
    face = assemble_face(built, names, paint_textures(data, ground, look), {"name": "head", **METADATA})
    face = replace(face, hairdo=DEFAULT_HAIRDO)
    return add_landmarks(face, ground.skin.base) if TABLE.is_file() else face, built


def paint_textures(data: Data, ground: ReferenceHead, look: HeadStyle) -> tuple[Texture, ...]:
    """Textures of skin, of brows and lashes, and of the eyes."""
    skin = paint_texture(data.source, ground.skin, ground.lids, look.palette, np.random.default_rng(look.seed))
    eye = eye_texture(read_picture(data.assets / asset_files()["eyes/grey"][1]), look.eyes)
    return Texture(skin), cards_texture(data.assets, look.palette.brows), Texture(eye)


def build_all(data: Data, out: Path, report: Callable[[str], None]) -> None:
    """Write the head, calibrated, and its haircuts into a folder; `report` gets the name of each step."""
    out.mkdir(parents=True, exist_ok=True)
    threads = available_cores()
    report("head and identities")
    ground = reference_head(data)
    bare, built = _build_default(data, ground)
    identities = build_identities(data.source, ground, HeadStyle(), built)
    report("occlusion of the head")
    head = bake_occlusion(bare, threads)  # haircuts need it without the light scattered in the mouth
    write_face(out / "head.face", scatter_in_mouth(head, ground.skin), identities)
    reference = stack_vertices(assemble_head(ground.cage, ground, HeadStyle()))
    for name, hair in build_haircuts(data.assets, ground.cage, ground.skin, reference):
        report(f"haircut {name}")
        write_hair(out / f"{name}.hair", bake_hair(head, hair, threads))
    report("calibration")
    calibrate_face_file(str(out / "head.face"), out / "head.face")
