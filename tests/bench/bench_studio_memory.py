"""Memory of a service with long projects of two users: PYTHONPATH=. python tests/bench/bench_studio_memory.py.

Two keys at once open projects of ten minutes over HTTP, each with a text of its own, fetch all curves and sound, edit
and fetch again. Printed after each: resident memory of the server and of its processes.
"""

import argparse
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

import httpx

from tests.bench.sentences import sentences
from tests.running import RunningService, ServeProcess
from tts2face.serving.service.keys import add_key
from tts2face.serving.studio.preview_bundle import read_bundle

SECONDS_OF_SENTENCE = 3.0  # at least: texts are as long as they must be
TRIES = 30  # of 120 s each, in which a preview is made


def resident_mb(root: int) -> dict[str, list[float]]:
    """Megabytes of a process and of its descendants, by the name of their program."""
    parents, sizes = dict[int, int](), dict[int, tuple[str, float]]()
    for folder in Path("/proc").iterdir():
        if folder.name.isdigit():
            try:
                lines = dict(line.split(":", 1) for line in (folder / "status").read_text().splitlines() if ":" in line)
                command = (folder / "cmdline").read_text().split("\0")
            except OSError:
                continue  # it ended meanwhile
            parents[int(folder.name)] = int(lines["PPid"])
            kind = next((part.rsplit(".", 1)[-1] for part in command if part.startswith("tts2face.")), "other")
            sizes[int(folder.name)] = (kind, int(lines.get("VmRSS", "0 kB").split()[0]) / 1000)
    found: dict[str, list[float]] = {"server": [sizes[root][1]]}
    for pid, (kind, size) in sizes.items():
        above = pid
        while above not in {0, 1, root}:
            above = parents.get(above, 0)
        if above == root and pid != root:
            found.setdefault(kind, []).append(size)
    return found


def text_of(number: int, minutes: float) -> str:
    """A text of so many minutes that no other number has."""
    return " ".join(sentences(round(60 * minutes / SECONDS_OF_SENTENCE), seed=number))


def main() -> None:
    """Print all figures."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--projects", type=int, default=10)
    parser.add_argument("--minutes", type=float, default=10.0)
    parser.add_argument("--previews-mb", type=int, default=300, help="limit of the server, as the setting")
    parser.add_argument("--sentences-mb", type=int, default=100, help="limit of each session, as the setting")
    parser.add_argument("--voice", default="espeak", help="the one that takes the least time")
    chosen = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "keys.toml")
        keys = [add_key(file, name, ["speak"]) for name in ("ann", "bob")]
        limits = {"PREVIEWS_MB": chosen.previews_mb, "SENTENCES_MB": chosen.sentences_mb}
        variables = {f"TTS2FACE_SERVE_{name}": str(value) for name, value in limits.items()}
        running = ServeProcess("--keys", str(file), environment=variables, processes=2)
        try:
            running.wait_until_ready()
            clients = [
                httpx.Client(
                    base_url=f"{running.url}/studio/api", headers={"Authorization": f"Bearer {key}"}, timeout=300
                )
                for key in keys
            ]
            show(running, "empty")
            begin = time.monotonic()
            with ThreadPoolExecutor(len(clients)) as users:
                jobs = [
                    users.submit(open_project, clients[number % 2], text_of(number, chosen.minutes), chosen.voice)
                    for number in range(chosen.projects)
                ]
                for number, job in enumerate(as_completed(jobs)):
                    seconds, n_bytes = job.result()
                    what = f"{number + 1} after {time.monotonic() - begin:.0f} s, the last of {seconds / 60:.1f} min"
                    show(running, f"{what} and {n_bytes / 1e6:.0f} MB")
        finally:
            running.close()


def open_project(client: httpx.Client, text: str, voice: str) -> tuple[float, int]:
    """Seconds and bytes of a new project's preview, after an edit."""
    number = client.post("/projects", json={"text": text}).json()["id"]
    edit = {"kind": "request", "options": {"voice": voice}}
    client.post(f"/projects/{number}/edits", json={"edit": edit}).raise_for_status()
    fetch(client, number)
    client.post(
        f"/projects/{number}/edits", json={"edit": {"kind": "gesture", "name": "nod", "time": 2.0, "size": 1.0}}
    )
    return fetch(client, number)


def fetch(client: httpx.Client, number: str) -> tuple[float, int]:
    """Seconds and bytes of the complete preview."""
    for _ in range(TRIES):
        answer = client.get(f"/projects/{number}/preview", params={"wait": 120})
        if answer.status_code == 200:
            header = read_bundle(answer.content)[0]
            if header["is_complete"]:
                assert not header["error"], header["error"]
                return header["duration"], len(answer.content)
    raise AssertionError(f"no complete preview: {answer.status_code} {answer.text[:200]}")


def show(running: RunningService, what: str) -> None:
    """Print the memory of all processes."""
    sizes = resident_mb(running.process.pid)
    print(
        f"{what}: "
        + "; ".join(f"{kind} {' + '.join(f'{one:.0f}' for one in each)} MB" for kind, each in sizes.items()),
        flush=True,
    )


if __name__ == "__main__":
    main()
