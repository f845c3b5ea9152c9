"""Files of each kind that a user gives, their readers, and what becomes of mutations of them."""

import copy
import json
import os
import time
import traceback
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import tts2face
from lexicon.errors import BackendError, DataError, InputError
from tests.face.test_hair import cap
from tests.face.test_lit_hair import haired_face, wig_of
from tests.fuzz.mutations import change_bytes, change_value, json_bytes, mutate_model, toml_bytes
from tests.gestures.test_key_curves import WHOLE
from tests.interchange.exports.made import made_clip, made_stream
from tests.models.made import write_made_face, write_made_palette, write_made_talker
from tests.picture.tiny_face import tiny_face
from tts2face.gestures.timeline_file import read_timeline, timeline_json
from tts2face.interchange.characters.shapes import read_mapping
from tts2face.models.face_file import Identity, read_face, write_face
from tts2face.models.face_schema import WIDE_OPEN
from tts2face.models.hair import attach_hair
from tts2face.models.hair_file import read_hair, write_hair, write_lit_hair
from tts2face.models.lit_hair import wear_hair
from tts2face.models.palette_file import read_palette
from tts2face.models.talker_file import read_talker
from tts2face.serving.batch.cast import read_cast
from tts2face.serving.service.keys import read_keys
from tts2face.serving.service.settings import ServiceSettings, read_settings
from tts2face.session.project_file import load_project

MOST_S = 5.0  # of processor time for one file; usual are milliseconds
MOST_CHARACTERS = 4_000  # of a message, which may name all choices
REFUSALS = (InputError, DataError, BackendError)

PROJECT: dict[str, Any] = {
    "format": "tts2face project",
    "version": 1,
    "name": "Scene",
    "request": {
        "text": "Tea for two.", "seed": 3, "style": "delighted", "rate": 1.25, "volume": 0.5, "voice": "espeak",
        "language": "en-gb", "context": 2, "exemplars": 8, "articulation": "1.5", "fps": 25.0, "gestures": "fields",
        "gain": "head=1.5", "expression": "happy=0.5@1-2", "pitch": True, "plain_delivery": True,
    },
    "models": {
        "talker": "grid_s1", "face": "head", "identity": "kofi", "palette": "starter", "hair": "bob01",
        "hair_color": "red",
    },
    "picture": {"size": "64x64", "camera": "10,20", "background": "#00ff00", "supersampling": 1, "quality": "draft"},
    "timeline": timeline_json(WHOLE),
    "pronunciations": {"two": "T UW1", "tea": "/tiː/"},
    "edges": [{"text": "", "occurrence": 0, "phones": ["t", "i"], "edges": [0.0, 0.1, 0.3]}],
    "excluded": [{"utterance": "bbaf2n", "start": 0.48}],
    "muted": ["brows"],
    "solo": ["head", "brows"],
}  # fmt: skip
CAST = {
    "default": {"face": "head", "language": "de", "rate": 1.1, "seed": 4},
    "role": [
        {"speaker": "ANN*", "identity": "kofi", "voice": "espeak-female", "style": "delighted", "hair": "bob01"},
        {"file": "b*", "subtitle_style": "Kara", "talker": "own.talker", "palette": "own.palette", "pitch": True},
    ],
}
MAPPING = {"shapes": {"jawOpen": "MouthOpen", "mouthSmileLeft": {"Smile": 0.5, "Grin": -1.0}, "tongueOut": "-"}}
MAPPING_TABLE = b"shape\tsource\tgain\njawOpen\tMouthOpen\nmouthSmileLeft\tSmile\t0.5\ntongueOut\t-\n"
SETTINGS = {
    one: value
    for one, value in ((name, getattr(ServiceSettings(), name)) for name in ServiceSettings.__dataclass_fields__)
    if value is not None
} | {"hosts": ["a.example"], "keys": "keys.toml", "webhook_hosts": ["b.example:80"], "webhook_secret": "hush"}
KEYS = {"key": [{"name": "studio", "hash": "ab" * 32, "scopes": ["speak"], "requests_per_minute": 60}]}
Read = Callable[[Path], object]


@dataclass(frozen=True)
class Kind:
    """Files of one suffix: how a mutation is written, given a seed, and the reader whose refusals are expected."""

    suffix: str
    mutate: Callable[[Path, int], str]
    read: Read


def document(suffix: str, content: Mapping[str, Any], write: Callable[[Any], bytes], read: Read) -> Kind:
    """Kind of files that hold a document; three of four mutations change values, the others bytes."""

    def mutate(path: Path, seed: int) -> str:
        rng, changed = np.random.default_rng(seed), copy.deepcopy(dict(content))
        if rng.random() < 0.25:
            written, what = change_bytes(write(changed), rng)
        else:
            what = "; ".join(change_value(changed, rng) for _ in range(1 if rng.random() < 0.8 else 2) if changed)
            written = write(changed)
        path.write_bytes(written)
        return what

    return Kind(suffix, mutate, read)


def model(source: Path, read: Read) -> Kind:
    """Kind of model files; one mutation of five changes bytes, half of these in the header."""

    def mutate(path: Path, seed: int) -> str:
        if seed % 5:
            return mutate_model(source, source.suffix[1:], path, seed)
        changed, what = change_bytes(source.read_bytes(), np.random.default_rng(seed), 2000 if seed % 2 else None)
        path.write_bytes(changed)
        return what

    return Kind(source.suffix, mutate, read)


def table(content: bytes, read: Read) -> Kind:
    """Kind of tables of text."""

    def mutate(path: Path, seed: int) -> str:
        changed, what = change_bytes(content, np.random.default_rng(seed))
        path.write_bytes(changed)
        return what

    return Kind(".tsv", mutate, read)


def convert_track(path: Path) -> None:
    """Read a track as `tts2face convert` does, and write it to three formats."""
    outs = [path.with_name(f"out{suffix}") for suffix in (".npz", ".wav", ".TextGrid")]
    tts2face.convert(path, outs)


def written_track(folder: Path, clips: Any) -> Any:
    """Document of a lossless track."""
    tts2face.export(clips, folder / "made.track.json")
    return json.loads((folder / "made.track.json").read_text(encoding="utf-8"))


def track_lines(content: Any) -> bytes:
    """A track as the program writes it, one piece on each line, where it has pieces."""
    if not isinstance(content.get("pieces"), list):
        return json_bytes(content)
    head = json_bytes({key: value for key, value in content.items() if key != "pieces"})[:-1]
    return head + b', "pieces": [\n' + b",\n".join(map(json_bytes, content["pieces"])) + b"\n]}\n"


def use_request(path: Path) -> None:
    """Load a project, and prepare it for a session."""
    load_project(path).prepare()


def use_timeline(path: Path) -> None:
    """Read a timeline, and write it again."""
    json.dumps(timeline_json(read_timeline(path)))


def kinds(folder: Path) -> dict[str, tuple[Kind, ...]]:
    """Kinds of files by name, with the files from which they are made in a folder."""
    dictionary = folder / "words.txt"
    dictionary.write_text("tea T IY1\n", encoding="utf-8")
    project = PROJECT | {"request": {**PROJECT["request"], "dictionary": str(dictionary)}}
    made = {kind: folder / f"made.{kind}" for kind in ("talker", "face", "palette", "hair")}
    write_made_talker(made["talker"], has_face=True)
    write_made_face(made["face"])
    face = read_face(made["face"])
    shadows = np.zeros((1 + (WIDE_OPEN in face.shape_names), len(face.vertices), 2), np.uint8)
    write_face(made["face"], replace(face, occlusion=shadows), {"older": Identity(np.ones_like(face.vertices))})
    write_made_palette(made["palette"])
    bare = tiny_face(textured=True)
    write_hair(made["hair"], cap(bare))
    lit = haired_face()
    write_lit_hair(folder / "lit.hair", wig_of(lit))
    stream = written_track(folder, [tts2face.Piece(clip, 0.0, 1, text="Tea.") for clip in made_stream(2, 3)])
    return {
        "model": (
            model(made["talker"], read_talker),
            model(made["face"], lambda path: read_face(path, "older")),
            model(made["palette"], read_palette),
            model(made["hair"], lambda path: attach_hair(bare, read_hair(path), "#ff0000")),
            model(folder / "lit.hair", lambda path: wear_hair(lit, read_hair(path)).light.baked),
        ),
        "project": (document(".json", project, json_bytes, use_request),),
        "timeline": (document(".json", timeline_json(WHOLE), json_bytes, use_timeline),),
        "cast": (document(".toml", CAST, toml_bytes, read_cast),),
        "mapping": (document(".toml", MAPPING, toml_bytes, read_mapping), table(MAPPING_TABLE, read_mapping)),
        "settings": (
            document(".toml", SETTINGS, toml_bytes, partial(read_settings, environment={})),
            document(".toml", KEYS, toml_bytes, read_keys),
        ),
        "track": (
            document(".track.json", written_track(folder, made_clip(3)), json_bytes, convert_track),
            document(".track.json", stream, track_lines, convert_track),
        ),
    }


def failures(every: tuple[Kind, ...], folder: Path, n_files: int) -> Iterator[str]:
    """What is wrong with the answers to mutated files, one line each; nothing if all are read or refused.

    Yields also a line if none, or less than a tenth, was refused: then the mutations change nothing.
    """
    n_refused = 0
    for seed in range(n_files):
        kind = every[seed % len(every)]
        path = folder / f"mutated{kind.suffix}"
        what, begin = kind.mutate(path, seed), time.process_time()
        try:
            kind.read(path)
        except REFUSALS as refused:
            n_refused += 1
            if len(str(refused)) > MOST_CHARACTERS:
                yield f"{seed} {what}: a message of {len(str(refused))} characters: {str(refused)[:100]}"
        except Exception:  # noqa: BLE001 - any other error is what is looked for
            yield f"{seed} {what}: {traceback.format_exc()[-1500:]}"
        if time.process_time() - begin > MOST_S:
            yield f"{seed} {what}: took {time.process_time() - begin:.1f} s of processor time"
    if not n_files / 10 < n_refused < n_files:
        yield f"{n_refused} of {n_files} files were refused"


def n_cases() -> int:
    """Mutated files of each kind in the tests of this folder."""
    return int(os.environ.get("TTS2FACE_FUZZ_CASES", "2000"))
