"""``tts2face "text"``: what the command does once its flags are read."""

import time
from dataclasses import dataclass
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING

from cli.progress import progress_bar, say
from lexicon.errors import InputError
from tts2face.models.files import write_whole
from tts2face.render.picture import Picture
from tts2face.request import Request

if TYPE_CHECKING:
    from tts2face.exemplar.explanation import ShownPhone
    from tts2face.session import Cast
    from tts2face.types import Clip

OWN = "self"  # the face that the talker herself shows
EXPLANATIONS = (".json", ".txt")


@dataclass(frozen=True, slots=True)
class Errand:
    """What is wanted beside the request and the picture."""

    out: Path | None
    talker: str
    face: str
    identity: str | None
    explain: Path | None
    view: bool
    quiet: bool


def run(request: Request, picture: Picture, errand: Errand) -> None:
    """Write, explain or show what was asked for."""
    if errand.out is None and errand.explain is None and not errand.view:
        raise InputError("say where the clip goes: --out clip.mp4 (or .webm, .gif, a folder for .png files)")
    if errand.explain is not None and errand.explain.suffix not in EXPLANATIONS:
        raise InputError(f"an explanation is written as .json or .txt, not {errand.explain.name}")
    is_silent = request.audio is not None or request.idle is not None
    if not request.text.strip() and (not is_silent or errand.explain is not None):
        raise InputError("the text is empty; give something to say, or what --audio says")
    if errand.view and errand.face == OWN:
        raise InputError("a window shows heads that can be turned; leave --view away, or choose --face head")
    if errand.view:
        from tts2face.render.window import require_display

        require_display("--view")
    if errand.out is not None:
        _make(request, picture, errand, errand.out)
    else:
        _only_told(request, errand)
    if errand.view:
        _view(request, picture, errand)


def _view(request: Request, picture: Picture, errand: Errand) -> None:
    from tts2face.api import stream
    from tts2face.render.window import view
    from tts2face.types import joined_clips

    ready = _ready(errand)
    face = ready.shown(request)
    if face is None:
        raise InputError("a window shows heads that can be turned; leave --view away, or choose --face head")
    view(joined_clips([piece.clip for piece in stream(request, ready)]), face, picture)


def _make(request: Request, picture: Picture, errand: Errand, out: Path) -> None:
    began = time.perf_counter()
    from tts2face.render.output_path import checked_output

    checked_output(out)
    from tts2face.api import check, write_clip

    check(request)
    ready = _ready(errand)
    told = _Explanation(ready, request)
    with progress_bar("speaking and drawing", errand.quiet) as on_progress:
        keep = told.add if errand.explain else None
        written = write_clip(request, picture, ready, out, on_progress=on_progress, on_clip=keep)
    if errand.explain:
        told.write(errand.explain)
    if not errand.quiet:
        took = time.perf_counter() - began
        say(
            f"wrote {written.path}: {written.seconds:.1f} s, {written.n_frames} frames, "
            f"made in {took:.1f} s ({written.seconds / took:.1f} x real time)"
        )
        for mark in written.marks:
            say(f"{mark.seconds:.2f} s: {mark.name}")


def _only_told(request: Request, errand: Errand) -> None:
    if errand.explain is None:
        return
    from tts2face.api import stream

    ready = _ready(errand)
    told = _Explanation(ready, request)
    for piece in stream(request, ready):
        told.add(piece.clip)
    told.write(errand.explain)


def _ready(errand: Errand) -> "Cast":
    from tts2face.models.face_file import load_face
    from tts2face.models.talker import load_talker
    from tts2face.session import cast
    from tts2face.synthesis.warm_up import compile_kernels, kernels_are_compiled

    talker = load_talker(errand.talker)
    if errand.face == OWN:
        if errand.identity is not None:
            raise InputError("her own face has one identity; leave --identity away, or choose --face head")
        return cast(talker, None)
    face = load_face(errand.face, errand.identity)
    if not kernels_are_compiled():
        if not errand.quiet:
            say("first run on this machine: compiling the kernels, which takes some ten seconds once")
        compile_kernels(face)
    return cast(talker, face)


class _Explanation:
    """Gathers which recorded phones moved the lips, clip by clip."""

    def __init__(self, ready: "Cast", request: Request) -> None:
        self._ready, self._request = ready, request
        self._seconds = 0.0
        self._shown: list[ShownPhone] = []

    def add(self, clip: "Clip") -> None:
        """Explain one more clip."""
        from tts2face.api import explain

        self._shown += explain(clip, self._ready, self._request, begins=self._seconds)
        self._seconds += clip.speech.waveform.duration

    def write(self, path: Path) -> None:
        """Write all as JSON or text, by suffix."""
        from tts2face.exemplar.explanation import explanation_json, explanation_text

        shown = tuple(self._shown)
        is_json = path.suffix == ".json"
        text = dumps(explanation_json(shown), ensure_ascii=False) if is_json else explanation_text(shown)
        write_whole(path, text.encode())
