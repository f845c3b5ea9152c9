"""Link from a face to the character that it was imported from, to write animation back onto its file."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from tts2face.interchange.characters.shapes import ShapeMapping, ShapeSource
from tts2face.interchange.gltf.container import MAGIC
from tts2face.models.face import Face
from tts2face.models.face_file import FORMAT_VERSION, KIND
from tts2face.models.face_schema import CHARACTER
from tts2face.storage.tensors import read_tensors

KEY = CHARACTER  # of the face's metadata


@dataclass(frozen=True, slots=True)
class CharacterBinding:
    """Link from a face to the file of its character.

    Parameters
    ----------
    file, sha256
        Path of the file and hash of its content; no hash for .obj files.
    yaw_deg, scale, origin
        Turn of the file's axes about y, then ``mm = (place - origin) * scale``.
    mapping
        Morph targets and expressions of each shape.
    """

    file: str
    sha256: str
    yaw_deg: float
    scale: float
    origin: tuple[float, float, float]
    mapping: ShapeMapping

    def as_metadata(self) -> dict[str, Any]:
        """The binding as JSON."""
        sources = {
            shape: [[source.name, source.gain, source.side] for source in self.mapping[shape]] for shape in self.mapping
        }
        plain = {key: value for key, value in asdict(self).items() if key != "mapping"}
        return plain | {"origin": list(self.origin), "mapping": sources}


def has_binding(face: Face) -> bool:
    """Whether a face was imported from a file onto which animation can be written."""
    found = face.metadata.get(KEY)
    return isinstance(found, dict) and bool(found.get("sha256"))


def read_binding(face: Face) -> CharacterBinding:
    """Binding of an imported face.

    Raises
    ------
    InputError
        The face was not imported, or was imported from .obj files.
    DataError
        Its metadata are damaged.
    """
    found = face.metadata.get(KEY)
    if not isinstance(found, dict):
        raise InputError("the face was not imported from a character's file; import one with `tts2face face import`")
    # faces of .obj folders have no file to write to
    if not found.get("sha256"):
        raise InputError("the face was imported from .obj files, which hold no animation; import a .glb file instead")
    return _parse(found)


def shape_mapping(face: Face) -> ShapeMapping | None:
    """The names that the shapes of an imported face have in its character; None for any other face.

    Raises
    ------
    DataError
        Its metadata are damaged.
    """
    found = face.metadata.get(KEY)
    return None if found is None else _parse(found).mapping


def without_file(metadata: Mapping[str, Any], content: bytes | None = None) -> dict[str, Any]:
    """Metadata of a face whose binding names no file of this machine, but keeps the names of the shapes if it is whole.

    The file that a sent face names would be read by exports. `content` is that of the character where the face's file
    holds it.
    """
    kept = {key: value for key, value in metadata.items() if key != KEY}
    try:
        binding = _parse(metadata.get(KEY))
    except DataError:
        return kept
    held = "" if content is None else sha256(content).hexdigest()
    return kept | {KEY: replace(binding, file="", sha256=held).as_metadata()}


def _parse(found: Any) -> CharacterBinding:
    try:
        x, y, z = (float(value) for value in found["origin"])
        binding = CharacterBinding(
            file=str(found["file"]),
            sha256=str(found["sha256"]),
            yaw_deg=float(found["yaw_deg"]),
            scale=float(found["scale"]),
            origin=(x, y, z),
            mapping={
                str(shape): tuple(ShapeSource(str(name), float(gain), str(side)) for name, gain, side in sources)
                for shape, sources in found["mapping"].items()
            },
        )
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise _damaged() from error
    gains = [source.gain for sources in binding.mapping.values() for source in sources]
    numbers = (binding.yaw_deg, binding.scale, x, y, z, *gains)
    if not all(math.isfinite(value) for value in numbers) or binding.scale <= 0:
        raise _damaged()
    return binding


def character_file(binding: CharacterBinding, given: str | Path | None = None) -> Path:
    """Path of the character's file, unchanged since its import; by default the path of the import.

    Raises
    ------
    DataError
        The file is missing or has changed.
    """
    path = Path(binding.file if given is None else given)
    if not path.is_file() and given is not None:
        raise DataError(f"there is no character {path}; check the path")
    if not path.is_file():
        raise DataError(
            f"there is no character {path}, from which the face was imported; "
            "if it was moved, run `tts2face face relink FACE.face CHARACTER`"
        )
    if sha256(character_bytes(path)).hexdigest() != binding.sha256:
        raise DataError(
            f"the content of {path} differs from the file from which the face was imported; "
            "import it again, or give that file"
        )
    return path


def character_bytes(path: Path) -> bytes:
    """Content of a character's file, or of that which a ``.face`` file holds."""
    content = path.read_bytes()
    is_gltf = content[:4] == MAGIC or content.lstrip()[:1] == b"{"
    # a file of tensors begins with the length of its header, which is JSON
    if is_gltf or content[8:9] != b"{":
        return content
    arrays, _ = read_tensors(path, KIND, FORMAT_VERSION)
    if CHARACTER not in arrays:
        raise DataError(f"{path} holds no character; import it again, or relink it")
    return arrays[CHARACTER].tobytes()


def _damaged() -> DataError:
    return DataError("what the face says about its character is damaged; import the character again")
