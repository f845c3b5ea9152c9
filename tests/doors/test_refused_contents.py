"""Files with a wrong content, and the sentence with which each is refused.

Rows of ``refused_contents.json``: kind of file, content, kind of error with its message, which may end with `REST`.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from corpus_tools.recordings.provenance import read_provenance
from lexicon.errors import Tts2faceError
from tts2face.gestures.timeline_file import read_timeline
from tts2face.interchange.characters.shapes import read_mapping
from tts2face.photo.fit import read_fit
from tts2face.serving.batch.cast import read_cast
from tts2face.serving.service.keys import read_keys
from tts2face.serving.service.settings import read_settings
from tts2face.serving.studio.editing import apply
from tts2face.serving.studio.reference import parse_reference
from tts2face.session.project import Project
from tts2face.session.project_file import load_project

REST = " ..."  # a list of names that grows
READERS: dict[str, tuple[str, Callable[[Path], Any]]] = {
    "timeline": ("a.json", read_timeline),
    "project": ("p.json", load_project),
    "keys": ("keys.toml", read_keys),
    "settings": ("s.toml", read_settings),
    "cast": ("cast.toml", read_cast),
    "mapping": ("m.toml", read_mapping),
    "fit": ("f.json", read_fit),
    "provenance": ("v.json", lambda path: read_provenance(path, must_exist=True)),
    "reference": ("r.json", lambda path: parse_reference(json.loads(path.read_text()), Path())),
    "edit": ("e.json", lambda path: apply(Project(), json.loads(path.read_text()))),
}
ROWS = json.loads(Path(__file__).with_name("refused_contents.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize(("kind", "content", "sentence"), ROWS)
def test_what_is_wrong_is_said_in_one_sentence(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, content: str, sentence: str
) -> None:
    monkeypatch.chdir(tmp_path)
    name, read = READERS[kind]
    Path(name).write_text(content, encoding="utf-8")
    with pytest.raises(Tts2faceError) as refused:
        read(Path(name))
    found = f"{type(refused.value).__name__}: {refused.value}"
    assert found.startswith(sentence.removesuffix(REST)) if sentence.endswith(REST) else found == sentence
