"""A small made world with known answers: a talker, a face, a palette and a voice, in memory and as files.

Doors, sessions, gestures and exports are tested on it where the shipped models are not the subject. A command, or a
process of its own, finds the files by ``--talker``, ``--face`` and ``--palette``, and the voice of tones, a plugin, by
``--voice tones`` (`World.environment`).
"""

import os
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tests.made_face import made_face
from tests.made_models import made_palette, made_talker
from tests.tones import VOICE, WorldVoices
from tts2face.models.face import Face
from tts2face.models.face_file import read_face, write_face
from tts2face.models.palette import Palette
from tts2face.models.palette_file import read_palette, write_palette
from tts2face.models.talker import Talker
from tts2face.models.talker_file import read_talker, write_talker
from tts2face.plugins import declared
from tts2face.session.session import Session

ROOT = Path(__file__).resolve().parents[1]


@dataclass(frozen=True, slots=True)
class World:
    """The made world: in memory, and as files of a folder."""

    talker: Talker
    face: Face
    palette: Palette
    folder: Path

    @property
    def talker_file(self) -> Path:
        return self.folder / "made.talker"

    @property
    def face_file(self) -> Path:
        return self.folder / "made.face"

    @property
    def palette_file(self) -> Path:
        return self.folder / "made.palette"

    @property
    def models(self) -> list[str]:
        """Options of the command line for its files."""
        files = {"--talker": self.talker_file, "--face": self.face_file, "--palette": self.palette_file}
        return [str(word) for pair in files.items() for word in pair]

    @property
    def flags(self) -> list[str]:
        """Options of the command line for its files and its voice."""
        return [*self.models, "--voice", VOICE]

    @property
    def environment(self) -> Mapping[str, str]:
        """Variables with which a process of its own finds the voice."""
        return {"PYTHONPATH": os.pathsep.join([str(ROOT), str(self.folder), os.environ.get("PYTHONPATH", "")])}

    def session(self, **options: Any) -> Session:
        """A session of the world, whose default voice is that of tones; options as of `Session`."""
        own = {"face": self.face, "palette": self.palette, "voices": WorldVoices()}
        return Session(**{"talker": self.talker, **own, **options})


def make_world(folder: Path) -> World:
    """Write the files of the world into a folder; what is in memory is read from them, with their rounding."""
    talker, face, palette = (folder / f"made.{kind}" for kind in ("talker", "face", "palette"))
    write_talker(talker, made_talker())
    write_face(face, made_face(), {})
    write_palette(palette, made_palette())
    about = folder / "made_world-1.dist-info"
    about.mkdir()
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: made_world\nVersion: 1\n")
    (about / "entry_points.txt").write_text(f"[tts2face.voices]\n{VOICE} = tests.tones:TONES\n")
    return World(read_talker(talker), read_face(face), read_palette(palette), folder)


@contextmanager
def voice_of_tones(world: World) -> Iterator[None]:
    """This process has the voice of tones."""
    sys.path.append(str(world.folder))
    declared.cache_clear()
    try:
        yield
    finally:
        sys.path.remove(str(world.folder))
        declared.cache_clear()
