"""Check of an uploaded talker, face, palette, dictionary or character, in a limited process.

What is stored is written here again from what was read, never the bytes of the upload.
"""

import json
import re
import time
from collections.abc import Callable, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from lexicon.errors import DataError, InputError
from tts2face.models.consent import PHOTO_TOOL, stated_consent
from tts2face.photo.photograph import HEIC_BRANDS
from tts2face.serving.work.character_archive import MAGIC as ARCHIVE_MAGIC
from tts2face.serving.work.character_archive import unpack_character
from tts2face.serving.work.resource_texts import UNPACKED, bounded, of_command, refusal, without_name
from tts2face.storage.marks import Mark, png_labels

if TYPE_CHECKING:
    from PIL.Image import Image

    from tts2face.session.session import Session


class RefusedFileError(DataError):
    """The file is not what it should be."""


TALKER = "talker"
FACE = "face"
PALETTE = "palette"
DICTIONARY = "dictionary"
CHARACTER, PHOTO = "character", "photo"  # files that become faces
TEXT_MARKS = "text_marks"
RESOURCE_KINDS = (TALKER, FACE, PALETTE, DICTIONARY, TEXT_MARKS)
TEXT_KINDS = frozenset((DICTIONARY, TEXT_MARKS))  # without a picture
# files of a checked resource
CONTENT = "content"
DESCRIPTION = "description.json"
PICTURE = "picture.png"
PICTURE_SIDE_PX = 384
TILE_SIDE_PX = 192
TILE_COLUMNS = 4
MAX_TILES = 12
REST_S, STYLE_S = 0.1, 2.0  # of idle motion that is synthesised for a picture
# CPU seconds: shipped models take 0.03, 0.4 and 0.02. A slower one would hold up the streams of everybody.
MAX_FRAME_CPU_S = 1.0
MAX_STYLE_CPU_S = 8.0
MAX_SPEECH_CPU_S = 4.0
# First bytes of files that are sent by mistake, or on purpose.
FOREIGN = {
    ARCHIVE_MAGIC: "a zip archive", b"\x80\x02": "a Python pickle", b"\x80\x03": "a Python pickle",
    b"\x80\x04": "a Python pickle", b"\x80\x05": "a Python pickle", b"\x93NUMPY": "a NumPy array",
    b"\x1f\x8b": "a gzip file", b"\x89PNG": "a picture", b"\xff\xd8\xff": "a picture", b"%PDF": "a PDF",
    b"glTF": "a glTF character", b"RIFF": "a sound or video", b"\x1aE\xdf\xa3": "a video",
}  # fmt: skip
GLTF_MAGIC = b"glTF"
PICTURE_MAGIC = (b"\x89PNG", b"\xff\xd8\xff", b"GIF8", b"BM", b"II*\x00", b"MM\x00*")
BOXED_PICTURES = ((0, b"RIFF", b"WEBP"), *((4, b"ftyp", brand) for brand in HEIC_BRANDS))  # offset, box, kind
N_MAGIC = 12  # bytes by which a picture is known
# Beside a photo: name of the face, consent of the person shown, pixels, corrections; beside a character: its mapping.
STATEMENT = "statement.json"
TOML_SHAPES = re.compile(r"^\s*\[\s*shapes\s*\]", re.MULTILINE)  # the table of a mapping in TOML
SHOWN, PLACES = "shown.jpg", "places.json"  # files of a photo whose places a person may correct
SHOWN_PX = 1600  # side of the picture that is shown for it, at most


def check_resource(kind: str, source: Path, folder: Path, max_bytes: float) -> None:
    """Check a file and write `CONTENT`, `DESCRIPTION` and, unless it is a dictionary, `PICTURE` into a folder.

    Parameters
    ----------
    kind
        One of `RESOURCE_KINDS`. Characters (.glb, .vrm, or folders as .zip) and photos, which have a file `STATEMENT`
        beside them, become faces.
    max_bytes
        Largest size of the written content.

    Raises
    ------
    RefusedFileError
        The file is of another type, damaged, or does not work.
    BackendError
        A model or package that the check needs is missing on this machine.
    """
    with source.open("rb") as file:
        head = file.read(N_MAGIC)
    if kind == FACE:
        kind = kind_of_face(head)
    try:
        if kind not in {*TEXT_KINDS, CHARACTER, PHOTO}:
            _check_type(kind, source)
        _describe(_CHECKS[kind](source, folder / CONTENT), folder)
        if kind not in TEXT_KINDS:
            draw_resource(FACE if kind in {CHARACTER, PHOTO} else kind, folder / CONTENT, folder / PICTURE)
    except (DataError, InputError) as error:
        raise RefusedFileError(refusal(error, source, folder, folder / CONTENT)) from error
    except MemoryError as error:
        raise RefusedFileError("it needs too much memory") from error
    # valid in form, but not usable
    except (ValueError, TypeError, KeyError, IndexError, ArithmeticError, EOFError) as error:
        raise RefusedFileError(f"it is no {kind} that works ({type(error).__name__})") from error
    if (folder / CONTENT).stat().st_size > max_bytes:
        raise RefusedFileError(f"it has more than {max_bytes / 1e6:g} MB as a {kind}")


def kind_of_face(head: bytes) -> str:
    """`CHARACTER`, `PHOTO` or `FACE`, by the first bytes of a file."""
    return CHARACTER if head.startswith((GLTF_MAGIC, ARCHIVE_MAGIC)) else PHOTO if is_picture(head) else FACE


def is_picture(head: bytes) -> bool:
    """Whether the first bytes of a file are those of a picture."""
    boxed = (head[at : at + 4] == box and head[8:].startswith(kind) for at, box, kind in BOXED_PICTURES)
    return head.startswith(PICTURE_MAGIC) or any(boxed)


def draw_resource(kind: str, source: Path, picture: Path) -> None:
    """Write the picture of a talker, face or palette that is known to be valid."""
    drawn, mark = _DRAW[kind](source)
    drawn.save(picture, "PNG", pnginfo=png_labels(mark))


def _check_type(kind: str, source: Path) -> None:
    """Refuse other types of files by their first bytes: model files are safetensors, which hold no code."""
    with source.open("rb") as file:
        head = file.read(9)
    for first_bytes, name in FOREIGN.items():
        if head.startswith(first_bytes):
            raise RefusedFileError(f"it is {name}, not a .{kind} file")
    if len(head) < 9 or head[8:] != b"{" or int.from_bytes(head[:8], "little") > source.stat().st_size:
        raise RefusedFileError(f"it is not a .{kind} file, or is truncated")


def _check_talker(source: Path, out: Path) -> dict[str, Any]:
    from tts2face.models.talker_file import FORMAT_VERSION, read_talker
    from tts2face.session.catalogue import describe_talker

    _rewrite(source, out, TALKER, FORMAT_VERSION)
    found = read_talker(out)
    if found.appearance is not None and stated_consent(found.metadata) is None:
        raise DataError("it shows a person's face, but states no consent; build it with --consent")
    _try_speech(out)
    return without_name(asdict(describe_talker(out)))


def _try_speech(content: Path) -> None:
    """Synthesise two sentences with a talker; the first one also compiles kernels."""
    from tts2face.session.session import Session

    session = Session(str(content), palette=None)
    session.clip("We were away.", voice="espeak", gestures="none")
    began = time.process_time()
    session.clip("Bob may move.", voice="espeak", gestures="none")
    if time.process_time() - began > MAX_SPEECH_CPU_S:
        raise RefusedFileError(f"a short sentence takes more than {MAX_SPEECH_CPU_S:g} s to synthesise")


def _check_face(source: Path, out: Path, character: bytes | None = None) -> dict[str, Any]:
    from tts2face.models import face_file
    from tts2face.session.catalogue import describe_face

    _rewrite(source, out, FACE, face_file.FORMAT_VERSION, character)
    face = face_file.read_face(out)
    if is_of_photo(face.metadata, in_picture=face.light.is_flat) and stated_consent(face.metadata) is None:
        raise DataError("it shows a person's photograph, but states no consent; make it with --consent")
    for identity in describe_face(out).identities:
        face_file.read_face(out, identity)
    return without_name(asdict(describe_face(out))) | {"licence": str(face.metadata.get("licence", "not stated"))}


def is_of_photo(metadata: Mapping[str, Any], *, in_picture: bool) -> bool:
    """Whether a face shows a person in a photograph, or as a head that was made of pictures."""
    return in_picture or metadata.get("made_by") == PHOTO_TOOL


def _check_character(source: Path, out: Path) -> dict[str, Any]:
    """Make a face of a character whose file holds everything that it needs, with the mapping that is sent with it."""
    from lexicon.values.json_text import read_json
    from tts2face.interchange.characters.importing import import_face
    from tts2face.interchange.characters.report import summary
    from tts2face.interchange.gltf.reader import read_gltf
    from tts2face.interchange.gltf.writer import GlbWriter
    from tts2face.models.face_file import write_face

    with source.open("rb") as file:
        is_archive = file.read(len(ARCHIVE_MAGIC)) == ARCHIVE_MAGIC
    named = source.with_name("character.glb")
    if is_archive:
        named = unpack_character(source, source.with_name(UNPACKED))
    else:
        named.hardlink_to(source)
    statement = source.with_name(STATEMENT)
    stated = read_json(statement) if statement.exists() else {}
    text = stated.get("mapping")
    mapping = None
    if text is not None:
        mapping = source.with_name("mapping.toml" if TOML_SHAPES.search(text) else "mapping.tsv")
        mapping.write_text(text, encoding="utf-8")
    imported = import_face(named, mapping=mapping, shapes=stated.get("shapes"))
    made = out.with_name("imported.face")
    write_face(made, imported.face)
    rows = [f"{name}: {text}" for name, text in summary(imported.report)]
    # clips as .glb are this file, written again from what was read of it, if its own shapes move it
    has_file = not named.is_dir() and not stated.get("shapes")
    content = GlbWriter(read_gltf(named)).content() if has_file else None
    return _check_face(made, out, content) | {"notes": [of_command(note) for note in (*imported.report.notes, *rows)]}


def _check_photo(source: Path, out: Path) -> dict[str, Any]:
    """Make a face that speaks in a photo."""
    from lexicon.values.json_text import parse_json
    from tts2face.models.face_file import write_face
    from tts2face.photo.face_from_photo import face_from_photo
    from tts2face.photo.fit import parse_fit

    notes: list[str] = []
    stated = read_statement(source)
    fit = stated.get("fit")
    given = None if fit is None else parse_fit(parse_json(fit, "the fit"))
    made = out.with_name("photo.face")
    face = face_from_photo(source, consent=stated["consent"], name=stated["name"], fit=given, on_warning=notes.append)
    write_face(made, face)
    return _check_face(made, out) | {"notes": [note.replace(str(source), "the photo") for note in notes]}


def read_statement(photo: Path) -> dict[str, Any]:
    """Statement beside a photo, whose size is checked.

    Raises
    ------
    DataError
        It has too many pixels.
    """
    from lexicon.values.json_text import read_json
    from tts2face.photo.photograph import open_photograph

    stated: dict[str, Any] = read_json(photo.with_name(STATEMENT))
    with open_photograph(photo) as file:
        if file.width * file.height > stated["max_pixels"]:
            raise DataError(
                f"{photo} has {file.width} x {file.height} pixels, more than {stated['max_pixels']}; reduce its size"
            )
    return stated


def find_places(source: Path, folder: Path) -> None:
    """Find lips, lids, teeth and pivot in a photo with a `STATEMENT`: write `PLACES`, and the picture as `SHOWN`."""
    from PIL import Image

    from tts2face.photo.face_from_photo import places_in_photo

    notes: list[str] = []
    try:
        read_statement(source)
        picture, fit = places_in_photo(source, notes.append)
    except (DataError, InputError) as error:
        raise RefusedFileError(refusal(error, source, folder, folder / CONTENT)) from error
    except MemoryError as error:
        raise RefusedFileError("it needs too much memory") from error
    height, width = picture.pixels.shape[:2]
    places = {
        "size": [round(width * picture.reduced_by), round(height * picture.reduced_by)], "fit": fit,
        "notes": [note.replace(str(source), "the photo") for note in notes],
    }  # fmt: skip
    (folder / PLACES).write_text(json.dumps(places))
    shown = Image.fromarray(picture.pixels)
    shown.thumbnail((SHOWN_PX, SHOWN_PX))
    shown.save(folder / SHOWN, "JPEG", quality=88)


def _check_palette(source: Path, out: Path) -> dict[str, Any]:
    from tts2face.models.palette_file import FORMAT_VERSION
    from tts2face.session.catalogue import styles

    _rewrite(source, out, PALETTE, FORMAT_VERSION)
    return {"styles": [{"name": style.name, "summary": style.summary} for style in styles(str(out))]}


def _check_dictionary(source: Path, out: Path) -> dict[str, Any]:
    from lexicon.dictionary import parse_dictionary
    from lexicon.values.files import read_text

    text = read_text(source)
    entries = parse_dictionary(text, "the dictionary").entries
    if not entries:
        raise DataError("it has no word; write one word and its pronunciation on each line")
    out.write_text(text, encoding="utf-8")
    return {"n_words": len(entries)}


def _check_text_marks(source: Path, out: Path) -> dict[str, Any]:
    from lexicon.mark_table import read_marks_table

    out.write_bytes(source.read_bytes())
    return {"n_marks": read_marks_table(out).n_own}


def _rewrite(source: Path, out: Path, kind: str, version: int, character: bytes | None = None) -> None:
    """Write arrays and metadata again, without links to files of the machine that made them.

    `character` is the content of the file that a face was imported from here; what a sent face holds is left out.
    """
    import numpy as np

    from tts2face.interchange.characters.binding import KEY, without_file
    from tts2face.models.face_schema import check_face
    from tts2face.storage.tensors import read_tensors, write_tensors

    arrays, metadata = read_tensors(source, kind, version)
    if kind == FACE:
        check_face(source, arrays, metadata)
        metadata = metadata | {"metadata": without_file(metadata["metadata"], character)}
        arrays.pop(KEY, None)
        if character is not None:
            arrays[KEY] = np.frombuffer(character, np.uint8)
    write_tensors(out, kind, version, arrays, metadata, is_packed=kind == FACE)


def _draw_talker(content: Path) -> "tuple[Image, Mark]":
    from tts2face.request import OWN_FACE
    from tts2face.session.catalogue import describe_talker
    from tts2face.session.session import Session

    face = OWN_FACE if describe_talker(content).has_own_face else None
    return _rest_picture(Session(str(content), face, palette=None))


def _draw_face(content: Path) -> "tuple[Image, Mark]":
    from tts2face.session.session import Session

    return _rest_picture(Session(face=str(content), palette=None))


def _draw_palette(content: Path) -> "tuple[Image, Mark]":
    """For each style the head in its typical pose: the frame of idle motion that is nearest to the mean."""
    import numpy as np
    from PIL import Image, ImageDraw

    from tts2face.picture.options import Picture
    from tts2face.session.session import Session

    session = Session(palette=str(content))
    names = session.palette.names[:MAX_TILES] if session.palette is not None else ()
    size = Picture(size=f"{TILE_SIDE_PX}x{TILE_SIDE_PX}")
    rows = -(-len(names) // TILE_COLUMNS)
    sheet = Image.new("RGB", (TILE_SIDE_PX * min(len(names), TILE_COLUMNS), TILE_SIDE_PX * rows), "white")
    pen = ImageDraw.Draw(sheet)
    for number, name in enumerate(names):
        began = time.process_time()
        clip = session.clip("", idle=STYLE_S, style=name)
        if number and time.process_time() - began > MAX_STYLE_CPU_S:  # the first one also compiles kernels
            raise RefusedFileError(f"{STYLE_S:g} s of a style take more than {MAX_STYLE_CPU_S:g} s to synthesise")
        values = clip.motion.values
        typical = int(np.linalg.norm(values - values.mean(axis=0), axis=1).argmin())
        tile = Image.fromarray(session.renderer(size).frame(clip, typical))
        place = TILE_SIDE_PX * (number % TILE_COLUMNS), TILE_SIDE_PX * (number // TILE_COLUMNS)
        sheet.paste(tile, place)
        pen.text((place[0] + 6, place[1] + 4), name[:24].encode("ascii", "replace").decode(), fill="white")
    return sheet, session.renderer(size).mark


def _rest_picture(session: "Session") -> "tuple[Image, Mark]":
    from PIL import Image

    from tts2face.picture.options import Picture

    clip = session.clip("", idle=REST_S, gestures="none")
    size = Picture(size=f"{PICTURE_SIDE_PX}x{PICTURE_SIDE_PX}")
    renderer = session.renderer(size, has_gestures=False)
    renderer.frame(clip, 0)  # compiles kernels
    began = time.process_time()
    picture = Image.fromarray(renderer.frame(clip, 1))
    if time.process_time() - began > MAX_FRAME_CPU_S:
        raise RefusedFileError(f"a picture of it takes more than {MAX_FRAME_CPU_S:g} s to draw; simplify it")
    return picture, renderer.mark


_CHECKS: Mapping[str, Callable[[Path, Path], dict[str, Any]]] = {
    TALKER: _check_talker,
    FACE: _check_face,
    PALETTE: _check_palette,
    DICTIONARY: _check_dictionary,
    TEXT_MARKS: _check_text_marks,
    CHARACTER: _check_character,
    PHOTO: _check_photo,
}
_DRAW: Mapping[str, Callable[[Path], "tuple[Image, Mark]"]] = {
    TALKER: _draw_talker,
    FACE: _draw_face,
    PALETTE: _draw_palette,
}


def _describe(description: dict[str, Any], folder: Path) -> None:
    text = json.dumps(bounded(description), ensure_ascii=False)
    (folder / DESCRIPTION).write_text(text, encoding="utf-8")
