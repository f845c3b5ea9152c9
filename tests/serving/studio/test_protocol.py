"""The JavaScript module of edits and elements."""

import re

from tts2face.gestures.kinds import KINDS
from tts2face.serving.studio.editing import EDITS
from tts2face.serving.studio.protocol import LIMITS, MODULE, protocol_module

COMPONENTS = {path.name: path.read_text(encoding="utf-8") for path in MODULE.parent.glob("*.js") if path != MODULE}


def test_the_module_is_that_of_the_tables() -> None:
    written = MODULE.read_text(encoding="utf-8")
    assert written == protocol_module(), "run `python -m tts2face.serving.studio.protocol`"


def test_components_make_edits_of_the_module_only() -> None:
    made = {name: set(re.findall(r"\bEDITS\.(\w+)", text)) for name, text in COMPONENTS.items()}
    assert {"paint", "erase", "gesture", "edge"} <= set().union(*made.values())
    assert {name: found - set(EDITS) for name, found in made.items() if found - set(EDITS)} == {}
    by_hand = re.compile(r'(?<!#)emit\((?:"edit", )?\{')
    assert [name for name, text in COMPONENTS.items() if by_hand.search(text)] == []


def test_components_name_kinds_of_elements_that_exist() -> None:
    importing = [text for text in COMPONENTS.values() if "protocol.js" in text]
    named = set().union(*(re.findall(r"\bKINDS\.(\w+)", text) for text in importing))
    assert named
    assert named <= set(KINDS)
    assert {name for kind in EDITS.values() for name in (kind.adds, kind.removes) if name} <= set(KINDS)
    assert set(LIMITS) <= set(KINDS)
