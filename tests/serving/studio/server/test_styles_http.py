"""Own styles over HTTP: made of a take, mixed, painted in a project, renamed, deleted, and nothing of them left."""

import io
import json
import time
import zipfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest
from PIL import Image

from tests.corpus_tools.test_takes_tool import write_table
from tests.running import eventually
from tests.serving.studio.server.test_projects_http import create, edit, preview
from tts2face.models.palette_file import load_palette, read_palette
from tts2face.serving.studio.style_tasks import N_TILES, TILE_PX
from tts2face.session.project_file import load_project
from tts2face.session.session import Session

TEXT = "Bob may move."
TABLE = {"Content-Type": "text/csv"}
MIX = {"source": "grid_s1", "shares": {"delighted": 0.5}, "sizes": {"head": 2.0}}


@pytest.fixture
def owned(studio: httpx.Client, data: Path):
    """The studio without own styles, before and after."""
    yield studio
    own = [one["name"] for one in studio.get("/api/styles").json()["styles"] if one["is_own"]]
    for name in own:
        studio.delete(f"/api/styles/{name}")
    assert not (data / "studio" / "palettes" / "local.styles" / "my-styles.palette").exists()


def wait_for_take(studio: httpx.Client) -> dict[str, Any]:
    def made() -> dict[str, Any] | None:
        take: dict[str, Any] = studio.get("/api/styles").json()["take"]
        return None if take["doing"] else take

    return dict(eventually(made, 120.0))


def mix(studio: httpx.Client, name: str, **changes: Any) -> None:
    assert studio.post("/api/styles", json={"name": name, "mix": MIX | changes}).status_code == 201


def styles(studio: httpx.Client) -> dict[str, dict[str, Any]]:
    return {one["name"]: one for one in studio.get("/api/styles").json()["styles"]}


def test_a_mixed_style_moves_a_project_as_its_archive_on_the_command_line(owned: httpx.Client, tmp_path: Path) -> None:
    mix(owned, "half glad")
    assert styles(owned)["half glad"] == {
        "name": "half glad", "source": "grid_s1", "summary": "delighted 50%, head x 2", "is_own": True
    }  # fmt: skip
    number = create(owned, TEXT)
    refused = edit(owned, number, {"kind": "models", "options": {"palette": "../../palettes/x.palette"}})
    assert refused.status_code == 400
    assert edit(owned, number, {"kind": "models", "options": {"palette": "my-styles"}}).status_code == 200
    span = {"kind": "paint", "feature": "all", "style": "half glad", "start": 0.0, "end": None}
    assert edit(owned, number, span).status_code == 200
    header, motion, head, _ = preview(owned, number)
    assert header["error"] == ""
    packed = zipfile.ZipFile(io.BytesIO(owned.get(f"/api/projects/{number}/project.zip").content))
    assert sorted(packed.namelist()) == ["my-styles.palette", "project.json"]
    packed.extractall(tmp_path)
    project = load_project(tmp_path / "project.json")
    clip = Session(palette=str(project.models.palette)).clip(project.prepare())
    np.testing.assert_array_equal(motion, clip.motion.values)
    np.testing.assert_array_equal(head, clip.head.values)
    plain = Session().clip(TEXT, voice="espeak")
    assert np.abs(motion[: len(plain.motion)] - plain.motion.values[: len(motion)]).max() > 0.05


def test_a_new_name_and_a_removal_reach_projects(owned: httpx.Client, data: Path) -> None:
    mix(owned, "first")
    mix(owned, "second")
    number = create(owned, TEXT)
    edit(owned, number, {"kind": "models", "options": {"palette": "my-styles"}})
    edit(owned, number, {"kind": "paint", "feature": "head", "style": "first", "start": 0.0, "end": 0.5})
    edit(owned, number, {"kind": "paint", "feature": "brows", "style": "delighted", "start": 0.0, "end": 0.5})

    def spans() -> dict[str, str]:
        timeline = load_project(data / "studio" / "projects" / number / "project.json").timeline
        return {span.feature: span.style for span in timeline.spans}

    assert owned.patch("/api/styles/first", json={"name": "calm one"}).status_code == 204
    assert spans() == {"head": "calm one", "brows": "delighted"}
    assert preview(owned, number)[0]["error"] == ""
    owned.post(f"/api/projects/{number}/undo")
    assert preview(owned, number)[0]["error"] == ""
    owned.post(f"/api/projects/{number}/redo")
    assert owned.delete("/api/styles/calm one").status_code == 204
    assert spans() == {"brows": "delighted"}
    header, before, _, _ = preview(owned, number)
    assert header["error"] == ""
    assert owned.delete("/api/styles/second").status_code == 204
    assert load_project(data / "studio" / "projects" / number / "project.json").models.palette == "starter"
    np.testing.assert_array_equal(preview(owned, number)[1], before)


def test_a_face_comes_though_its_palette_is_removed_while_it_is_made(owned: httpx.Client) -> None:
    mix(owned, "short-lived")
    number = create(owned, TEXT)
    looks = {"palette": "my-styles", "face": "head", "hair_color": "#123457"}  # a face that is not kept yet
    assert edit(owned, number, {"kind": "models", "options": looks}).status_code == 200
    with ThreadPoolExecutor(1) as pool:
        asked = pool.submit(owned.get, f"/api/projects/{number}/face.glb")
        time.sleep(0.2)  # of some seconds
        assert owned.delete("/api/styles/short-lived").status_code == 204
        assert not asked.done()
        answer = asked.result()
    assert answer.status_code == 200, answer.text
    assert answer.content[:4] == b"glTF"


def test_a_take_becomes_a_style_and_is_deleted(owned: httpx.Client, data: Path, tmp_path: Path) -> None:
    table = write_table(tmp_path / "take.csv", 7).read_text().splitlines()
    owned.put("/api/styles/take/0", content="\n".join(table[:32]), headers=TABLE)
    short = wait_for_take(owned)
    assert (short["state"], short["advice"]) == (
        "refused", "the face is seen for 1.0 s, limit 2.5 s; record a longer take"
    )  # fmt: skip
    answer = owned.post("/api/styles", json={"name": "short"})
    assert answer.status_code == 400
    assert "record it again, or upload another one" in answer.json()["error"]["message"]
    owned.put("/api/styles/take/0", content="\n".join(table), headers=TABLE)
    assert wait_for_take(owned)["state"] == "weak"
    assert owned.post("/api/styles", json={"name": "delighted"}).status_code == 400
    assert owned.post("/api/styles", json={"name": "live one"}).status_code == 201
    assert wait_for_take(owned)["advice"] == "the style live one is made of 7 s; its take is deleted"
    assert styles(owned)["live one"]["summary"] == "recorded, 7 s"
    folder = data / "studio" / "palettes" / "local.styles"
    assert not (folder / "take").exists()
    picture = Image.open(io.BytesIO(owned.get("/api/styles/live one/swatch.webp").content))
    assert picture.size == (N_TILES * TILE_PX, TILE_PX)
    tiles = np.split(np.asarray(picture.convert("RGB"), np.float64), N_TILES, axis=1)
    assert np.abs(tiles[0] - tiles[10]).mean() > 0.5  # of 255: it moves
    (tmp_path / "mine.palette").write_bytes(owned.get("/api/styles/my-styles.palette").content)
    mine, starter = read_palette(tmp_path / "mine.palette"), load_palette("starter")
    assert set(mine.styles) == {*starter.styles, "live one"}
    for feature, values in starter.styles["grid_s1"].motion.items():
        np.testing.assert_array_equal(mine.styles["grid_s1"].motion[feature], values)
    mix(owned, "livelier", source="live one")
    number = create(owned, TEXT)
    edit(owned, number, {"kind": "models", "options": {"palette": "my-styles"}})
    edit(owned, number, {"kind": "paint", "feature": "head", "style": "live one", "start": 0.0, "end": 0.5})
    assert "livelier is derived from live one" in owned.delete("/api/styles/live one").json()["error"]["message"]
    (span,) = owned.get(f"/api/projects/{number}/project.json").json()["timeline"]["spans"]
    assert span["style"] == "live one"  # what is refused changes nothing
    assert owned.delete("/api/styles/livelier").status_code == 204
    assert owned.delete("/api/styles/live one").status_code == 204
    assert [path.name for path in folder.rglob("*") if path.is_file()] == []


def test_a_mix_is_seen_before_it_is_kept(owned: httpx.Client) -> None:
    def drawn(mixed: Any) -> httpx.Response:
        return owned.get("/api/styles/mix.webp", params={"mix": json.dumps(mixed)})

    annoyed = drawn({"source": "grid_s1", "shares": {"annoyed": 1}}).content
    assert annoyed == owned.get("/api/styles/annoyed/swatch.webp").content
    assert drawn(MIX).content != annoyed
    assert "the mix: give an object in curly brackets" in drawn([]).json()["error"]["message"]
