"""Statements of files on their making: marks of synthesis, texts and voices, and who signed them."""

from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.files import check_regular_file
from lexicon.values.json_text import parse_json
from tts2face.storage.mark_readers import MOST_BYTES, find_packet, parse_packet
from tts2face.storage.marks import COMPOSITE, MAX_TEXT, OWN_PARTS, SOURCE_TYPES, Mark
from tts2face.storage.signing import Signature, Signer, read_signature
from tts2face.video.container import open_container

# IPTC's types of which a generative model made all, or a part; the last one is of any other synthesis
SYNTHETIC = frozenset({
    "trainedAlgorithmicMedia", "compositeWithTrainedAlgorithmicMedia", "compositeSynthetic", "algorithmicMedia",
    "virtualRecording",
})  # fmt: skip
# Parts of a mark by names of properties and tags, of files of others, too; the first that is there counts.
NAMES: Mapping[str, tuple[str, ...]] = {
    "source": ("iptc:DigitalSourceType", "digital_source_type", "digitalsourcetype"),
    "notice": ("photoshop:Instructions", "comment", "notice", "description"),
    "program": ("xmp:CreatorTool", "encoded_by", "generator", "encoder"),
    "created": ("xmp:CreateDate", "created", "date", "creation_time"),
    "face": ("made:face", "face"),
    "voice": ("made:voice", "voice"),
    "text": ("made:text", "spoken_text", "text"),
}
GLTF_HEAD = b"glTF"
WEBM_SUFFIXES = (".webm", ".weba")


@dataclass(frozen=True, slots=True)
class FileMarks:
    """Statements of a file on its making; parts that it does not state are empty.

    Parameters
    ----------
    format
        Of the file, as its content shows it.
    source
        IPTC's type of digital source: the last part of its address, or all of another one.
    notice, program, created, face, voice, text
        As of `tts2face.storage.marks.Mark`; of files of others what stands in their place.
    signature
        Manifest of C2PA in it or beside it; None without one.
    """

    path: Path
    format: str
    source: str = ""
    notice: str = ""
    program: str = ""
    created: str = ""
    face: str = ""
    voice: str = ""
    text: str = ""
    signature: Signature | None = field(default=None)

    @property
    def is_synthetic(self) -> bool:
        """Whether its own mark, or its signed manifest, states a synthetic source."""
        signed = self.signature.source if self.signature is not None else ""
        return not SYNTHETIC.isdisjoint({self.source, signed})

    def as_json(self) -> dict[str, Any]:
        """All parts by name, with ``synthetic``."""
        content = asdict(self) | {"path": str(self.path), "synthetic": self.is_synthetic}
        if self.source:
            content["digital_source_type"] = _uri(self.source)
        return content


def inspect_file(path: str | Path) -> FileMarks:
    """Statements of a file of sound, pictures, video or motion on its making, also of one of another program.

    A place that nobody knows may hold more; an absent mark is no proof of anything.

    Raises
    ------
    InputError
        There is no file.
    DataError
        The file is damaged, or no file of a known format.
    """
    path = Path(path)
    if not path.exists():
        raise InputError(f"there is no file {path}; check the path")
    check_regular_file(path)
    found = find_packet(path)
    format, said = found.format, dict(parse_packet(found.packet))
    if found.comment:
        said.setdefault("comment", found.comment)
    if not format:
        format, tags = _free_fields(path)
        said = tags | said
    elif format in {"mov", "mp4", "wav"}:
        said = _tags(path)[1] | said
    parts = {part: _first(said, names) for part, names in NAMES.items()}
    parts["source"] = parts["source"].removeprefix(SOURCE_TYPES).removeprefix(SOURCE_TYPES.replace("http:", "https:"))
    signature = read_signature(path, format, is_there=found.has_signature)
    return FileMarks(path, format, **parts, signature=signature)


def joined_mark(paths: Iterable[Path], signer: Signer | None = None, *, is_recorded: bool = False) -> Mark | None:
    """Mark of a file that is joined of others; None where none of them has one."""
    marks = [found for found in map(inspect_file, paths) if found.source]
    if not marks:
        return None
    texts = {
        name: list(dict.fromkeys(value for found in marks if (value := getattr(found, name)))) for name in OWN_PARTS
    }
    parts = {name: (" " if name == "text" else ", ").join(values)[:MAX_TEXT] for name, values in texts.items()}
    first = next((found for found in marks if found.source == COMPOSITE), marks[0])
    mark = Mark(first.notice, first.source, **parts, signer=signer)
    return replace(mark, source=COMPOSITE) if is_recorded else mark


def _first(said: Mapping[str, str], names: tuple[str, ...]) -> str:
    return next((said[name] for name in names if said.get(name)), "")


def _uri(source: str) -> str:
    return source if "/" in source else SOURCE_TYPES + source


def _free_fields(path: Path) -> tuple[str, dict[str, str]]:
    """Format and texts by name of a file without a packet: ``asset`` of glTF, JSON, or tags of a container."""
    with path.open("rb") as file:
        head = file.read(20)
        if head[:4] == GLTF_HEAD:
            return "glb", _gltf_fields(file.read(int.from_bytes(head[12:16], "little")), path)
    if path.suffix.lower() == ".gltf":
        return "gltf", _gltf_fields(path.read_bytes(), path)
    return _tags(path)


def _gltf_fields(content: bytes, path: Path) -> dict[str, str]:
    try:
        root = parse_json(content.decode(), str(path))
    except UnicodeDecodeError as broken:
        raise DataError(f"{path} is no glTF that can be read; export it again") from broken
    asset = root.get("asset") if isinstance(root, dict) else None
    if not isinstance(asset, dict):
        raise DataError(f"{path} is no glTF: it has no asset; export it again")
    extras = asset.get("extras")
    fields = {**asset, **(extras if isinstance(extras, dict) else {})}
    return {name.lower(): value for name, value in fields.items() if isinstance(value, str)}


def _tags(path: Path) -> tuple[str, dict[str, str]]:
    """Format and tags of a container, and of its streams, by lower-case name."""
    with open_container(path) as container:
        tags = [container.metadata, *(stream.metadata for stream in container.streams)]
        known = container.format.name.split(",")
        format = "webm" if path.suffix.lower() in WEBM_SUFFIXES and "webm" in known else known[0].removesuffix("_pipe")
        said: dict[str, str] = {}
        for name, value in (pair for found in tags for pair in found.items()):
            if len(value) <= MOST_BYTES:
                said.setdefault(name.lower(), value)
    if packet := said.pop("id3v2_priv.xmp", ""):
        said |= parse_packet(packet.encode())
    return format, said
