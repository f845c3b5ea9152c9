"""Names of haircuts, and the face that is shown where none is named; no numeric library is imported for them."""

from pathlib import Path

from tts2face.request import DRAWN_FACE, REALISTIC_FACE
from tts2face.storage.shipped import SHIPPED_FOLDER

BALD = "bald"  # haircut without hair
HAIR_KIND = "hair"
OF_FACE = "-"  # between the names of a face with baked light and of its haircut, in the name of a file


def haircut_names(face: str = "") -> tuple[str, ...]:
    """Names of the shipped haircuts of a face with baked light beside its own; without a face those for heads."""
    stems = sorted(path.stem for path in SHIPPED_FOLDER.glob(f"*.{HAIR_KIND}"))
    if face:
        return tuple(stem.removeprefix(face + OF_FACE) for stem in stems if stem.startswith(face + OF_FACE))
    return tuple(stem for stem in stems if OF_FACE not in stem)


def default_face(identity: str | None, hair: str | None) -> str:
    """Face that is shown where none is named: the one that the other options belong to."""
    is_for_heads = hair is not None and (hair in (BALD, *haircut_names()) or bool(Path(hair).suffix))
    return DRAWN_FACE if identity is None and not is_for_heads else REALISTIC_FACE
