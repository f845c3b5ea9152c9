"""Hair and eyes of avatars beside those in their pictures: python -m tests.bench.bench_avatar_looks [FIRST LAST].

Looks of even numbers and those to 139 chose limits; odd ones from 141 to 195 are the figures of docs/photo.md.
"""

import sys
from collections import Counter
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from corpus_tools.dense.avatar import build_avatar
from corpus_tools.dense.light_colour import log_colour
from corpus_tools.dense.person_look import PersonLook, _nearest
from lexicon.errors import DataError
from tests.bench.known_looks import DRAWN, RIGHT, SHORT, KnownLook, draw_look, known_look
from tests.corpus_tools.build.likeness import difference_2000, lab_colour
from tts2face.models.face_loading import load_face
from tts2face.models.named_colours import EYE_COLOURS, parse_hair_colour
from tts2face.numeric.arrays import decode_srgb

BROWN = ("brown", "dark-brown")  # one answer: drawn light decides between them


def hair_apart(look: KnownLook, found: PersonLook) -> float:
    """CIEDE2000 of the colours of hair, as it is seen; NaN of bald heads."""
    own = load_face(look.face).hairdo
    if found.length == "bald" or look.key in ("bald", "stubble") or own is None:
        return np.nan
    colours = (look.colour or own.colour, found.hairdo.colour)
    one, other = (lab_colour(decode_srgb(parse_hair_colour(colour))) for colour in colours)
    return float(difference_2000(one, other))


def main() -> None:
    """Print a row a picture and the sums."""
    numbers = range(int(sys.argv[1]), int(sys.argv[2]) + 1, 2) if len(sys.argv) > 2 else range(141, 197, 2)
    right, apart = Counter[str](), []
    with TemporaryDirectory() as folder:
        for number in numbers:
            look, path = known_look(number), Path(folder) / f"{number}.png"
            draw_look(look).save(path)
            try:
                found = build_avatar([path], path.with_suffix(".face"), consent="nobody").look
            except DataError as refused:
                print(f"| {number} | {look.key} | refused: {refused} |")
                continue
            eyes = _nearest(log_colour(found.iris.astype(np.float64)), EYE_COLOURS)
            has_hair = found.length in RIGHT[look.key] + (SHORT if look.hat else ())
            has_eyes = eyes == look.eyes or {eyes, look.eyes} <= set(BROWN)
            kind = "drawn" if look.face in DRAWN else "people"
            right.update({f"{kind}: pictures": 1, f"{kind}: hair": has_hair, f"{kind}: eyes": has_eyes})
            apart.append(hair_apart(look, found))
            hat = f" ({look.hat})" if look.hat else ""
            print(f"| {number} | {look.key}{hat} | {found.length} | {look.eyes} | {eyes} | {apart[-1]:.0f} |")
    print(*(f"{name} {count}" for name, count in sorted(right.items())), sep="\n")
    print(f"colour of hair: CIEDE2000 {np.nanmedian(apart):.1f} (median)")


if __name__ == "__main__":
    main()
