"""Eight requests through other doors than `Session.write`; each gives the fingerprint of what it makes in a folder."""

import csv
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from tests.golden.fingerprints import Fingerprint, hashed, of_clips, of_files, of_pictures
from tests.walkers import samples_of
from tts2face.picture.options import Picture
from tts2face.request import Request
from tts2face.session.clip_files import load_clip, write_clip
from tts2face.session.named_models import Models
from tts2face.session.session import Session
from tts2face.session.session_cache import SessionCache

SESSIONS = SessionCache(3)  # of the shipped models; what was made before does not change a result
SMALL = {"size": "64x64", "supersampling": 1}
PICTURE = Picture(**SMALL)
CHEAP = {"voice": "espeak", "fps": 10.0}
TEXT_EXPORTS = (
    "track.json", "csv", "a2f.json", "bvh", "oculus.jsonl", "azure.jsonl", "curves.jsonl", "rhubarb.json",
    "rhubarb.tsv", "rhubarb.xml", "textgrid", "vtt", "srt", "words.vtt", "words.srt", "karaoke.vtt", "wav",
)  # fmt: skip
SRT = (
    "1\n00:00:00,200 --> 00:00:01,000\nANN: Hello there.\n\n"
    "2\n00:00:01,200 --> 00:00:01,900\n[door slams] Good morning to you.\n"
)
CAST = '[[role]]\nspeaker = "ANN"\nstyle = "delighted"\nrate = 1.1\n'
PROJECT = {
    "format": "tts2face project",
    "version": 1,
    "request": {"text": "Bob may move. Tea for two.", **CHEAP},
    "picture": SMALL,
    "timeline": {
        "spans": [{"feature": "head", "style": "delighted", "start": 0.2, "end": 1.0}],
        "edits": [{"channel": "jawOpen", "keys": [[0.5, 0.0], [1.0, 0.25], [1.5, 0.0]]}],
        "gaze": [{"down_deg": -5.0, "left_deg": 20.0, "start": 1.0, "end": 2.0}],
    },
    "pronunciations": {"tea": "/ti/"},
    "muted": ["brows"],
}
DROPPED = frozenset({"cheekPuff", "noseSneerLeft", "noseSneerRight", "mouthLeft", "mouthRight", "jawLeft", "jawRight"})
# Parts of a batch's manifest that name the program's version, its models and the time of its work, or repeat the film.
VOLATILE = {"program", "segments", "address", "took_s", "sha256", "bytes"}
NEEDS: Mapping[str, Sequence[str]] = {
    "http_clip": ("fastapi", "httpx", "prometheus_client"),
    "http_job": ("fastapi", "httpx", "prometheus_client", "dbos"),
    "similarity": ("matplotlib", "sklearn"),
}


def batch(folder: Path) -> Fingerprint:
    """Two cues of subtitles with a cast: films, tracks, captions and the manifest."""
    from tts2face.serving.batch.cast import read_cast
    from tts2face.serving.batch.options import BatchOptions
    from tts2face.serving.batch.plan import plan_batch
    from tts2face.serving.batch.run import run_batch

    (folder / "one.srt").write_text(SRT, encoding="utf-8")
    (folder / "cast.toml").write_text(CAST, encoding="utf-8")
    options, request = BatchOptions(exports=("track.json", "words.srt", "wav")), Request(**CHEAP)
    cast = read_cast(folder / "cast.toml")
    plan = plan_batch([folder / "one.srt"], options, request=request, picture=PICTURE, cast=cast)
    result = run_batch(plan, folder / "out")
    assert (result.n_made, result.failed) == (2, ())
    return of_outputs(folder / "out")


def of_outputs(folder: Path) -> Fingerprint:
    """Outputs of a batch; motion and sound are those of the tracks."""
    tracks = sorted(folder.glob("*.track.json"))
    films = sorted(folder.glob("*.mp4"))
    texts = [path for path in folder.iterdir() if path.is_file() and path not in films and "manifest" not in path.name]
    files = of_files(texts)["files"]
    content = json.loads((folder / "manifest.json").read_text(encoding="utf-8"))
    files["manifest.json"] = hashed(json.dumps(without(content, folder)).encode())
    with (folder / "manifest.csv").open(encoding="utf-8", newline="") as table:
        files["manifest.csv"] = hashed(json.dumps(without(list(csv.DictReader(table)), folder)).encode())
    return of_clips([load_clip(path) for path in tracks]) | {"files": files, "films": of_files(films)["files"]}


def without(content: Any, folder: Path) -> Any:
    """JSON without the volatile parts and without the path of the folder."""
    if isinstance(content, dict):
        return {name: without(value, folder) for name, value in content.items() if name not in VOLATILE}
    if isinstance(content, list):
        return [without(value, folder) for value in content]
    return content.replace(str(folder.parent), "") if isinstance(content, str) else content


def project(folder: Path) -> Fingerprint:
    """A project file with a painted style, a pronunciation and a muted feature; all exports that are text or sound."""
    from tts2face.session.project_file import load_project

    (folder / "scene.json").write_text(json.dumps(PROJECT), encoding="utf-8")
    loaded = load_project(folder / "scene.json")
    exports = [folder / f"scene.{suffix}" for suffix in TEXT_EXPORTS]
    clips = []
    SESSIONS.get(loaded.models).write(
        loaded.prepare(),
        folder / "frames",
        picture=loaded.picture,
        exports=exports,
        on_piece=lambda piece: clips.append(piece.clip),
    )
    return of_clips(clips) | of_pictures(folder / "frames") | of_files(exports)


def character(folder: Path) -> Fingerprint:
    """A character of another program: imported, saved, drawn, and animated in its own file."""
    from tests.interchange.characters.made import Variant, head_without_mouth, write_character_file, write_landmarks
    from tts2face.interchange.characters.animation import write_character
    from tts2face.interchange.characters.importing import import_face
    from tts2face.interchange.characters.saving import save_face

    variant = Variant(is_skinned=True, is_dense=True, dropped=DROPPED)
    made = write_character_file(folder / "made.glb", variant, head_without_mouth())
    save_face(folder / "made.face", import_face(made, landmarks=write_landmarks(folder / "made.tsv")).face)
    session = Session(face=folder / "made.face")
    clip = session.clip("Bob may move.", **CHEAP)
    write_clip(clip, session.face, folder / "frames", picture=PICTURE)
    animated = write_character(clip, session.mesh, folder / "animated.glb").path
    return of_clips([clip]) | of_pictures(folder / "frames") | of_files([animated, animated.with_suffix(".wav")])


def own_files(folder: Path) -> Fingerprint:
    """A talker, face, palette and dictionary by file, shown by the face and then by the talker's own face."""
    from tests.models.made import write_made_models, write_made_talker

    paths = write_made_models(folder, b"away  M AA1 M AA0\n")
    write_made_talker(folder / "own.talker", has_face=True)
    options = {"text": "We were away.", "dictionary": paths["dictionary"], **CHEAP}
    shown = (
        (Session(paths["talker"], paths["face"], palette=paths["palette"]), {"gestures": "none"}),  # it has no lids
        (Session(folder / "own.talker", "self", palette=paths["palette"]), {"style": "quick"}),
    )
    found: list[Fingerprint] = []
    for number, (session, gestures) in enumerate(shown):
        clip = session.clip(Request(**options, **gestures))
        write_clip(clip, session.animated_face(has_gestures="style" in gestures), folder / f"{number}", picture=PICTURE)
        found.append(of_clips([clip]) | of_pictures(folder / f"{number}"))
    mesh, own = found
    return mesh | {"own": own}


def live(folder: Path) -> Fingerprint:
    """A stream that is extended while it plays, with idle motion between."""
    session = SESSIONS.get(Models())
    stream = session.live(style="annoyed", **CHEAP)
    pieces = [*stream.say("Hello there. Bob may move."), *stream.idle(0.5), *stream.say("A year ago.")]
    for number, piece in enumerate(pieces):
        write_clip(piece.clip, session.face, folder / f"{number}", picture=PICTURE)
    pictures = [of_pictures(folder / f"{number}")["pictures"] for number in range(len(pieces))]
    return of_clips([piece.clip for piece in pieces]) | {"pictures": pictures}


def similarity(folder: Path) -> Fingerprint:
    """The report of the similarity of a made talker's phones, compared with another one's: page, figures and table."""
    from corpus_tools.studies.similarity.analysis import NamedTalker, SimilarityOptions, analyse
    from corpus_tools.studies.similarity.write import similarity_report
    from tests.corpus_tools.similarity.steady_talker import made_talker

    made, other = NamedTalker("made", made_talker(20)), NamedTalker("other", made_talker(20, seed=9, gain=20.0))
    found = analyse(made, SimilarityOptions(halves=3), other)
    paths = [folder / f"report{suffix}" for suffix in (".html", ".json", ".csv")]
    for path in paths:
        path.write_bytes(similarity_report("both").formats[path.suffix](found))
    table = json.loads((folder / "report.json").read_text(encoding="utf-8"))["similarity"]
    return of_files(paths) | {"means": [round(sum(map(abs, row)) / len(row), 4) for row in table]}


def http_clip(folder: Path) -> Fingerprint:
    """A clip over HTTP as a film, as curves and as sound: the bodies of the answers."""
    from tests.serving.service.in_process import SessionProcess, service_client
    from tts2face.serving.service.settings import ServiceSettings

    options = {"text": "Bob may move.", "style": "delighted", **SMALL, **CHEAP}
    paths = [folder / f"clip.{name}" for name in ("mp4", "curves", "wav")]
    settings = ServiceSettings(data=folder / "data", workers=0, studio=False)
    with service_client(settings, SessionProcess(SESSIONS)) as client:
        for path in paths:
            answer = client.post("/v1/clips", json={**options, "format": path.suffix[1:]})
            assert answer.status_code == 200, answer.text
            path.write_bytes(answer.content)
    lines = [json.loads(line) for line in paths[1].read_text(encoding="utf-8").splitlines()[1:]]
    columns = zip(*(line["weights"] + line["head"] for line in lines), strict=True)
    return of_files(paths) | {
        "n_frames": len(lines),
        "n_samples": len(samples_of(paths[2].read_bytes())) // 2,
        "means": [round(sum(map(abs, column)) / len(lines), 4) for column in columns],
    }


def http_job(folder: Path) -> Fingerprint:
    """A job of subtitles over HTTP, with a SQLite database and a worker in this process: its results."""
    from tests.serving.service.in_process import SessionProcess, service_client, working
    from tests.serving.service.job_requests import finished
    from tts2face.serving.service.settings import ServiceSettings

    settings = ServiceSettings(data=folder / "data", workers=0, studio=False)
    request = {**SMALL, **CHEAP, "exports": ["track.json", "words.srt"]}
    form = {"job": json.dumps({"kind": "subtitles", "request": request})}
    out = folder / "out"
    out.mkdir()
    with service_client(settings, SessionProcess(SESSIONS)) as client:
        with working(settings):
            answer = client.post("/v1/jobs", data=form, files=[("subtitles", ("one.srt", SRT[: SRT.index("2\n")]))])
            job = finished(client, answer.json())
        assert (job["state"], job["error"]) == ("done", None), job
        for result in job["results"]:
            (out / result["name"]).write_bytes(client.get(result["url"]).content)
    return of_outputs(out)


DOORS: Mapping[str, Callable[[Path], Fingerprint]] = {
    "project": project, "live": live, "http_clip": http_clip, "http_job": http_job, "batch": batch,
    "character": character, "own_files": own_files, "similarity": similarity,
}  # fmt: skip
