"""The shipped head, its identities and haircuts from MakeHuman's data."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from corpus_tools.shipped.head.assets import asset_files, fetch_assets, read_picture
from corpus_tools.shipped.head.cage import Cage, build_cage
from corpus_tools.shipped.head.cards import cards_texture
from corpus_tools.shipped.head.correspondence import TABLE, add_landmarks
from corpus_tools.shipped.head.eyes import eye_texture
from corpus_tools.shipped.head.haircut import build_haircuts
from corpus_tools.shipped.head.head import REFERENCE_PERSON, HeadStyle, ReferenceHead, assemble_head, build_reference
from corpus_tools.shipped.head.mouth_light import scatter_in_mouth
from corpus_tools.shipped.head.parts import HeadPieces, assemble_face, stack_vertices
from corpus_tools.shipped.head.presets import build_identities, refresh_presets
from corpus_tools.shipped.head.proportions import add_targets, modelling_targets
from corpus_tools.shipped.head.source import PACKAGE, SourceMesh, fetch_data, read_source
from corpus_tools.shipped.head.texture import paint_texture
from corpus_tools.shipped.head.tongue import TONGUE_UP
from corpus_tools.shipped.head.tongue_out import give_way
from corpus_tools.training.calibrate_file import calibrate_face_file
from tts2face.models.face import Face, Hairdo, Texture
from tts2face.models.face_file import write_face
from tts2face.models.hair_file import write_hair
from tts2face.picture.occlusion import bake_hair, bake_occlusion
from tts2face.processes.threads import available_cores

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
    """Sources of the faces: MakeHuman's mesh, and the folder of its assets."""

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
    return give_way(add_landmarks(face, ground.skin.base)) if TABLE.is_file() else face, built


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
    refresh_presets(out / "head.face")
    reference = stack_vertices(assemble_head(ground.cage, ground, HeadStyle()))
    for name, hair in build_haircuts(data.assets, ground.cage, ground.skin, reference):
        report(f"haircut {name}")
        write_hair(out / f"{name}.hair", bake_hair(head, hair, threads))
    report("calibration")
    calibrate_face_file(str(out / "head.face"), out / "head.face")
