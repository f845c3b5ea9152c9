"""Characters that a client sends as one .zip: a folder of .obj files, or a glTF file with its buffers and images."""

import zipfile
import zlib
from pathlib import Path

from lexicon.errors import DataError
from tts2face.interchange.characters.import_notes import some_of
from tts2face.interchange.characters.obj_reader import OBJ
from tts2face.interchange.gltf.reader import SUFFIXES

MAGIC = b"PK\x03\x04"
MAX_BYTES, MAX_FILES = 512_000_000, 2000  # unpacked: as much as one file of a character may have
FOREIGN = "__MACOSX"  # folder that macOS adds, with a file beside each file


def unpack_character(archive: Path, folder: Path) -> Path:
    """The file or folder of the one character in an archive, which is unpacked into a new folder."""
    try:
        with zipfile.ZipFile(archive) as packed:
            files = [entry for entry in packed.infolist() if not entry.is_dir() and FOREIGN not in entry.filename]
            size = sum(entry.file_size for entry in files)
            if size > MAX_BYTES or len(files) > MAX_FILES:
                raise DataError(
                    f"the archive unpacks to {len(files)} files of {size / 1e6:.0f} MB, more than {MAX_FILES} files or "
                    f"{MAX_BYTES / 1e6:.0f} MB; pack the character alone"
                )
            for entry in files:
                packed.extract(entry, folder)
    # RuntimeError: encrypted; NotImplementedError, a kind of it: a compression that Python lacks
    except (zipfile.BadZipFile, RuntimeError, OSError, EOFError, zlib.error) as wrong:
        raise DataError("the archive is damaged, locked or of an unknown compression; pack it again as .zip") from wrong
    return _character_in(folder)


def _character_in(folder: Path) -> Path:
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    found = [path for path in files if path.suffix.lower() in SUFFIXES]
    meshes = [path for path in files if path.suffix.lower() == OBJ]
    # one alone is a head without shapes, whatever its name; more are one at rest and its shapes
    found = found or (meshes if len(meshes) == 1 else list(dict.fromkeys(path.parent for path in meshes)))
    if len(found) > 1:
        names = some_of([path.relative_to(folder).as_posix() for path in found])
        raise DataError(f"the archive holds several characters ({names}); pack one of them")
    if not found:
        kinds = ", ".join((*SUFFIXES, OBJ))
        raise DataError(f"the archive holds no character ({kinds}), but {some_of([path.name for path in files])}")
    return found[0]
