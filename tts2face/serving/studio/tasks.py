"""Tasks of a project: its curves and sound, one of its pictures, its files, its face, and how a phone of it was made.

An order has the project in ``request``: ``project`` (its JSON), ``folder`` (where its files are), and ``text``, which
the service checks as that of any request.
"""

import hashlib
import io
import zipfile
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, replace
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from lexicon.errors import DataError, InputError
from lexicon.sequence import PhoneSequence
from tts2face.gestures.kinds import BeyondClipError
from tts2face.lips.explanation import PhoneExplanation
from tts2face.lips.outlines import N_INSTANTS, LipOutline, lip_outlines, token_outlines
from tts2face.models.talker import Talker
from tts2face.serving.service.messages import DRAWING_THREADS, Event, Inputs, Task, Work
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.corrections import StaleEdgesError
from tts2face.session.project import Project, cut_timeline, without_edges
from tts2face.session.project_file import parse_project
from tts2face.storage.marks import png_labels
from tts2face.storage.wave_files import pcm_bytes
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session.session import Session
    from tts2face.session.speech_stream import Piece


# of a piece; two pieces of one project with equal ones are not to be expected
DIGEST_BYTES = 12
MAX_EXAMPLES = 12  # of an explained phone
N_DECIMALS = 2  # of outlines, mm


def read_project(work: Work) -> Project:
    """Project of an order."""
    project = parse_project(work.request["project"], "the project", Path(work.request["folder"]))
    # with the paths of uploaded faces, which say who is shown
    return replace(project, models=replace(project.models, face=work.models.get("face") or project.models.face))


def preview(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """Curves and sound of a project, sentence by sentence.

    An event ``begin``; for each sentence an event ``piece``, and its motion, head pose and sound if its digest is not
    among ``have`` of the request; then an event ``end``. Where a correction no longer fits, it is removed, and all is
    sent again from ``begin``; ``end`` says what was removed.
    """
    project = read_project(work)
    dropped = []
    cut_to = None
    have = frozenset(work.request.get("have", ()))
    while True:
        yield Event({"type": "begin", "fps": float(project.request.fps)})
        try:
            for event, content in _pieces(session, project, have):
                yield Event(event)
                if content:
                    yield Chunk(content)
            break
        except StaleEdgesError as stale:
            dropped.append([stale.text, stale.occurrence])
            project = without_edges(project, [(stale.text, stale.occurrence)])
        except BeyondClipError as beyond:
            # once is enough: a project that still does not fit has another fault
            if cut_to is not None:
                raise
            cut_to = beyond.duration
            project = cut_timeline(project, cut_to)
    yield Event({"type": "end", "dropped": dropped, "cut_to": cut_to})


def digest_of(parts: Iterable[bytes]) -> str:
    """Digests of motion, head pose and sound of a piece, one after the other."""
    return "".join(hashlib.blake2b(part, digest_size=DIGEST_BYTES).hexdigest() for part in parts)


def _pieces(session: "Session", project: Project, have: frozenset[str]) -> Iterator[tuple[dict[str, Any], bytes]]:
    """Description and content of each piece; the content is empty if its digest is in `have`."""
    said: Counter[str] = Counter()
    prepared = session.prepare(project.prepare())
    for number, piece in enumerate(session.stream(prepared)):
        clip = piece.clip
        motion = clip.motion.values
        head = clip.head.values
        samples = clip.speech.waveform.samples
        sound = pcm_bytes(np.clip(samples, -1.0, 1.0))
        parts = [motion.astype("<f4").tobytes(), head.astype("<f4").tobytes(), sound]
        digest = digest_of(parts)
        event = {
            "type": "piece", "number": number, "text": piece.text, "occurrence": said[piece.text],
            "seconds": clip.speech.waveform.duration, "rate": clip.speech.waveform.rate,
            "n_frames": len(motion), "n_samples": len(samples), "digest": digest,
            **_timing(piece),
            "notes": [*(prepared.notes if number == 0 else ()), *(miss.sentence for miss in piece.mismatches)],
        }  # fmt: skip
        if number == 0:
            event["channels"] = list(clip.motion.channels)
        if piece.transcript is not None:
            event["transcript"] = _phones(piece.transcript)
        said[piece.text] += 1
        yield event, b"" if digest in have else b"".join(parts)


def _timing(piece: "Piece") -> dict[str, Any]:
    """Start of the sentence in the clip, and its phones and words in seconds of the sentence."""
    speech = piece.speech
    edges = speech.phones.edges
    phones = piece.sentence or speech.phones
    start = phones.start
    times = [(word, float(edges[word.first]) - start, float(edges[word.last]) - start) for word in speech.words]
    return {
        "begin": piece.begin + start,
        **_phones(PhoneSequence(phones.phones, phones.edges - start)),
        "words": [[word.text, round(begin, 6), round(end, 6), word.is_doubtful] for word, begin, end in times],
    }


def _phones(phones: PhoneSequence) -> dict[str, Any]:
    return {"phones": list(phones.phones), "edges": [round(float(edge), 9) for edge in phones.edges]}


def picture(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """PNG of one instant of a project, at ``time`` seconds."""
    from PIL import Image

    project, time = read_project(work), float(work.request["time"])
    last = None
    prepared = session.prepare(project.prepare())
    for last in session.stream(prepared):
        if time < last.begin + last.clip.speech.waveform.duration:
            break
        yield Chunk(b"")
    assert last is not None
    number = min(max(round((time - last.begin) * last.clip.fps), 0), len(last.clip.motion) - 1)
    renderer = session.renderer(project.picture, has_gestures=project.request.has_gestures)
    content = io.BytesIO()
    labels = png_labels(renderer.mark.of(session.making(prepared), is_recorded=last.clip.speech.is_recorded))
    Image.fromarray(renderer.frame(last.clip, number)).save(content, "PNG", compress_level=3, pnginfo=labels)
    yield Chunk(content.getvalue())


def project_file(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """Bytes of a project's clip as a complete file in a format of `Session.stream_file`."""
    project = read_project(work)
    return session.stream_file(
        project.prepare(), work.format, picture=project.picture, threads=DRAWING_THREADS, is_complete=True
    )


def project_export(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """Bytes of an export of a project, whose file is named by ``name``; several files come as one .zip file."""
    from tts2face.session.encoded_stream import encode_whole

    project = read_project(work)
    face = session.animated_face(has_gestures=project.request.has_gestures)
    prepared = session.prepare(project.prepare())
    return encode_whole(session.stream(prepared), work.request["name"], (face, session.making(prepared)), _packed)


def _packed(folder: Path) -> Path:
    """The one file of a folder, or a .zip file of all."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    if len(files) == 1:
        return files[0]
    packed = folder / "files.zip"
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for file in files:
            archive.write(file, file.relative_to(folder))
    return packed


def face_file(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """The session's face with its morph targets for a page (`tts2face.interchange.exports.stage_glb`)."""
    from tts2face.interchange.exports.stage_glb import stage_glb

    face = session.animated_face(has_gestures=bool(work.request.get("has_gestures", True)))
    yield Chunk(stage_glb(face.mesh, face.channels))


def explain(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """The phone at ``time`` seconds with the recorded examples that made it; no phone where none is used.

    Each example has ``outlines`` of its lips, the phone those of the lips that were ``made``; empty if there are none.
    """
    project, time = read_project(work), float(work.request["time"])
    phone: PhoneExplanation | None = None
    made: list[dict[str, Any]] = []
    for piece in session.stream(project.prepare()):
        is_here = time < piece.begin + piece.clip.speech.waveform.duration
        if phone is None and (is_here or piece.transcript is not None):
            phone = next((spoken for spoken in piece.explain() if spoken.start <= time < spoken.end), None)
        if is_here and phone is not None:
            face = session.animated_face(has_gestures=project.request.has_gestures)
            made = _made_outlines(face, piece, phone)
        if is_here:
            break
        yield Chunk(b"")
    yield Event({"type": "explanation", "phone": None if phone is None else _described(session.talker, phone, made)})


def _described(talker: Talker, phone: PhoneExplanation, made: list[dict[str, Any]]) -> dict[str, Any]:
    found = asdict(phone)
    used = phone.tokens[:MAX_EXAMPLES]
    found["tokens"] = [asdict(token) | {"outlines": _outlines_json(token_outlines(talker, token))} for token in used]
    return found | {"made": made}


def _made_outlines(face: AnimatedFace, piece: "Piece", phone: PhoneExplanation) -> list[dict[str, Any]]:
    """Outlines of the lips of a piece from the beginning of a phone to its end; empty if the face cannot tell."""
    motion = piece.clip.motion
    times = np.linspace(phone.start, phone.end, N_INSTANTS) - piece.begin
    shown = motion.at(times)
    still = np.zeros_like(shown[:1])
    try:
        moved, rest = (face.landmarks(replace(motion, values=values)) for values in (shown, still))
    except (DataError, InputError):
        return []
    return _outlines_json(lip_outlines(moved, rest[0]))


def _outlines_json(outlines: tuple[LipOutline, ...]) -> list[dict[str, Any]]:
    return [
        {name: getattr(outline, name).astype(float).round(N_DECIMALS).tolist() for name in ("outer", "inner")}
        for outline in outlines
    ]


TASKS: Mapping[str, Task] = MappingProxyType({
    "project": preview, "picture": picture, "project-file": project_file, "project-export": project_export,
    "face": face_file, "explain": explain,
})  # fmt: skip
