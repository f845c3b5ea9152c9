"""A character that speaks by visemes alone, in every kind of request of a running service: nothing stays still."""

import asyncio
import csv
import json
from collections.abc import Iterator
from typing import Any

import httpx
import numpy as np
import pytest
from websockets.asyncio.client import connect

from tests.interchange.characters.made import Variant, head_without_mouth, split_glb, write_character_file
from tests.interchange.characters.made import write_landmarks as write_true_landmarks
from tests.running import RunningService
from tts2face.interchange.characters.importing import import_face
from tts2face.interchange.characters.saving import save_face

TEXT = "Papa saw fifty boats."
FAMILIES = {
    "oculus": {
        "viseme_aa": "jawOpen", "viseme_E": "mouthStretchLeft", "viseme_I": "mouthSmileLeft", "viseme_O": "mouthFunnel",
        "viseme_U": "mouthPucker", "viseme_PP": "mouthPressLeft", "viseme_FF": "mouthRollLower",
    },
    "vowels": {"A": "jawOpen", "I": "mouthSmileLeft", "U": "mouthPucker", "E": "mouthStretchLeft", "O": "mouthFunnel"},
}  # fmt: skip


@pytest.fixture(scope="module", params=FAMILIES)
def sent(
    service: RunningService, request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[str, tuple[str, ...]]]:
    """Name of a face at the service, and the names of its character's shapes."""
    folder, head = tmp_path_factory.mktemp("character"), head_without_mouth()
    name = str(request.param)
    names = {shape: own for own, shape in FAMILIES[name].items()}
    variant = Variant(rename=names.__getitem__, dropped=frozenset(set(head.shape_names) - set(names)))
    character = write_character_file(folder / "a.glb", variant, head)
    save_face(folder / "a.face", import_face(character, landmarks=write_true_landmarks(folder / "a.tsv")).face)
    files = {"file": (folder / "a.face").read_bytes()}
    answer = httpx.post(f"{service.url}/v1/faces", data={"name": name}, files=files, timeout=300)
    assert answer.status_code == 201, answer.text
    yield name, tuple(names.values())
    httpx.delete(f"{service.url}/v1/faces/{name}")


def clip(client: httpx.Client, face: str, kind: str) -> httpx.Response:
    options = {"text": TEXT, "face": face, "format": kind, "size": "64x64", "fps": 10}
    answer = client.post("/v1/clips", json=options, timeout=120)
    assert answer.status_code == 200, answer.text
    return answer


def test_visemes_are_expressed_by_arkits_jaw_and_lips(client: httpx.Client, sent: tuple[str, tuple[str, ...]]) -> None:
    rows = list(csv.DictReader(clip(client, sent[0], "livelink").text.splitlines()))
    table = {name: max(float(row[name]) for row in rows) for name in ("JawOpen", "MouthPucker", "MouthSmileLeft")}
    assert table["JawOpen"] > 0.1
    assert table["MouthPucker"] > 0.2
    first, *lines = [json.loads(line) for line in clip(client, sent[0], "curves").text.splitlines()]
    jaw = [line["weights"][first["weights"].index("jawOpen")] for line in lines if "weights" in line]
    assert max(jaw) == pytest.approx(table["JawOpen"], abs=0.002)


def test_files_of_the_character_move(client: httpx.Client, sent: tuple[str, tuple[str, ...]]) -> None:
    root, _ = split_glb(clip(client, sent[0], "glb").content)
    assert any(channel["target"]["path"] == "weights" for channel in root["animations"][0]["channels"])
    motion, binary = split_glb(clip(client, sent[0], "vrma").content)
    moved: list[str] = list(motion["extensions"]["VRMC_vrm_animation"]["expressions"]["preset"])
    assert {"aa", "ou"} <= set(moved)
    assert len(binary) > 100
    assert clip(client, sent[0], "mp4").content[4:8] == b"ftyp"


def test_a_stream_holds_its_own_visemes(service: RunningService, sent: tuple[str, tuple[str, ...]]) -> None:
    async def run() -> list[dict[str, Any]]:
        async with connect(service.url.replace("http", "ws") + "/v1/stream") as socket:
            await socket.send(json.dumps({"type": "start", "with_idle": False, "face": sent[0]}))
            for message in ({"type": "text", "text": TEXT}, {"type": "end"}):
                await socket.send(json.dumps(message))
            return [json.loads(message) async for message in socket if isinstance(message, str)]

    events = asyncio.run(run())
    assert events[-1] == {"type": "done"}
    curves = [event for event in events if event["type"] == "curves"]
    names: list[str] = curves[0]["names"]
    reach = np.array([row for event in curves for row in event["weights"]]).max(axis=0)
    assert set(sent[1]) <= set(names)
    assert sum(reach[names.index(own)] > 0.1 for own in sent[1]) >= 3
