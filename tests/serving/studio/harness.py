"""A page with stage and timeline whose face, motion and sound a real session makes, for tests in a browser.

``python -m tests.serving.studio.harness FOLDER serve`` is ``tts2face serve`` with this page at ``/studio/harness``;
files that take seconds are kept in FOLDER. Edits that the timeline emits are listed in the page, and those that add
something come back as a server would send them.
"""

import json
import struct
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
from fastapi import Request as HttpRequest
from fastapi.responses import Response
from nicegui import app, ui

from cli.main import main
from tts2face.gestures.timeline_file import parse_timeline_object, timeline_json
from tts2face.interchange.exports.stage_glb import stage_glb
from tts2face.models.palette import FEATURES
from tts2face.serving.studio.components.stage import StageElement
from tts2face.serving.studio.components.timeline import TimelineElement
from tts2face.session.session import Session
from tts2face.types import Clip

TEXT = "We were away a year ago, but Bob may move five big maps."
PLACES = {  # of edits that add an element, in a timeline's JSON
    "paint": "spans", "gesture": "gestures", "gaze": "gaze", "listen": "listens", "strength": "strengths",
    "curve": "curves", "channel": "edits",
}  # fmt: skip
STYLES = [
    {"name": "measured", "color": "#7f8a99"},
    {"name": "delighted", "color": "#3aa757"},
    {"name": "somber", "color": "#4a6fd0"},
    {"name": "irritated", "color": "#d0573a"},
]

MAKING = threading.Lock()

PAGE = "height: 100vh; padding: 8px; gap: 8px; display: flex; flex-direction: column"
LAYER = "will-change: transform"  # as on the pages


def bundle(clip: Clip, revision: int, repeats: int = 1) -> bytes:
    """The clip, so many times in a row, as a preview bundle of docs/http.md."""
    motion, head = (np.tile(track.values, (repeats, 1)) for track in (clip.motion, clip.head))
    samples = np.tile(clip.speech.waveform.samples, repeats)
    pcm = np.rint(np.clip(samples, -1, 1) * 32767).astype("<i2")
    length, edges = clip.speech.waveform.duration, clip.speech.phones.edges
    words, phones, sentences = [], [], []
    for number in range(repeats):
        begin = number * length
        sentences.append([TEXT, number, begin, begin + length])
        for index, label in enumerate(clip.speech.phones.phones):
            phones.append([label, begin + edges[index], begin + edges[index + 1], number, index])
        for word in clip.speech.words:
            words.append([word.text, begin + edges[word.first], begin + edges[word.last], number])
    header = {
        "revision": revision,
        "fps": clip.motion.fps,
        "n_frames": len(motion),
        "first_frame": 0,
        "n": len(motion),
        "channels": list(clip.motion.channels),
        "rate": clip.speech.waveform.rate,
        "n_samples": len(pcm),
        "sound_first": 0,
        "duration": len(pcm) / clip.speech.waveform.rate,
        "words": words,
        "phones": phones,
        "sentences": sentences,
        "notes": [],
    }
    text = json.dumps(header).encode()
    return b"".join([
        struct.pack("<I", len(text)), text, motion.astype("<f4").tobytes(), head.astype("<f4").tobytes(), pcm.tobytes(),
    ])  # fmt: skip


def make_files(folder: Path) -> None:
    """Write face, previews and a rendered frame into a folder that lacks them."""
    if (folder / "long.bin").exists():
        return
    folder.mkdir(parents=True, exist_ok=True)
    session = Session()
    clip = session.clip(TEXT)
    (folder / "face.glb").write_bytes(stage_glb(session.mesh, clip.motion.channels))
    (folder / "clip.bin").write_bytes(bundle(clip, 1))
    other = session.clip(TEXT, style="delighted", seed=3)
    (folder / "other.bin").write_bytes(bundle(other, 1))
    (folder / "long.bin").write_bytes(bundle(clip, 1, repeats=round(600 / clip.speech.waveform.duration)))


def add_page(files: Path) -> None:
    """Add the page and its files to NiceGUI."""

    @app.get("/files/{name}")
    def file(name: str, request: HttpRequest) -> Response:
        """One of the files, once: a page that has it is told that nothing changed."""
        if request.query_params.get("have"):
            return Response(status_code=204)
        with MAKING:
            make_files(files)
        return Response((files / name).read_bytes(), media_type="application/octet-stream")

    @ui.page("/harness")
    def page(preview: str = "clip.bin", compare: str = "", tool: str = "brush", dark: bool = False) -> None:
        """Stage and timeline, and the edits as they come."""
        edits: list[dict[str, Any]] = []
        content: dict[str, Any] = {}
        lanes = {feature: {"feature": feature} for feature in FEATURES}

        def apply(edit: dict[str, Any]) -> None:
            edits.append(edit)
            listed.set_text(json.dumps(edits))
            rest = {name: value for name, value in edit.items() if name != "kind"}
            if edit["kind"] in {"mute", "solo"}:
                lanes[edit["feature"]]["muted" if edit["kind"] == "mute" else "solo"] = edit["on"]
                timeline.set_lanes(list(lanes.values()))
            elif edit["kind"] == "seed":
                content["seeds"] = {**content.get("seeds", {}), edit["feature"]: edit["seed"]}
            elif edit["kind"] in PLACES:
                later = parse_timeline_object({PLACES[edit["kind"]]: [rest]} if rest.get("keys") != [] else {})
                content.update(timeline_json(parse_timeline_object(content).merge(later)))
            timeline.set_timeline(content)

        ui.dark_mode(dark)
        ui.query(".nicegui-content").classes("p-0 gap-0")
        ui.query("body").style("background: var(--studio-page)")
        with ui.element("div").classes("w-full").style(PAGE):
            with ui.element("div").style("flex: 0 1 480px; min-height: 200px; display: flex; gap: 8px"):
                with ui.element("div").style(f"width: 640px; {LAYER}"):
                    stage = StageElement("/studio/files/face.glb", preview=f"/studio/files/{preview}")
                with ui.element("div").style(f"flex: 1; color: var(--studio-text); {LAYER}"):
                    ui.label("Harness of the components").props("role=heading aria-level=1").classes("text-h6")
                    picked = ui.label().classes("picked")
                    listed = ui.label("[]").classes("edits").style("overflow-wrap: anywhere; font-size: 11px")
            timeline = TimelineElement(
                styles=STYLES, brush={"tool": tool, "style": "delighted"},
                on_edit=lambda event: apply(event.args), compare=f"/studio/files/{compare}" if compare else None,
            ).style(f"flex: 1 1 0; min-height: 250px; {LAYER}")  # fmt: skip
            timeline.on("pick", lambda event: picked.set_text(json.dumps(event.args)))
            ui.on("show_view", lambda event: stage.view(event.args))


if __name__ == "__main__":
    add_page(Path(sys.argv.pop(1)))
    main()
