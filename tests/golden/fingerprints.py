"""Fingerprints of results, and those that are kept: for each machine that made some, in `requests.json`."""

import hashlib
import json
import platform
from collections.abc import Iterable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import numpy as np

from tests.walkers import unmarked
from tts2face.types import Clip

KEPT = Path(__file__).with_name("requests.json")
DECIDES = (
    "numpy", "scipy", "numba", "onnxruntime", "hibari-tts", "espeakng-loader", "hama", "pillow", "soxr", "av",
    "scikit-learn",
)  # fmt: skip
MEANS = 0.15  # share: libraries and processors differ in the last bits, which a field's draw amplifies (decision 159)
SAMPLES = 0.02  # share: a voice on another processor speaks a little longer or shorter
COUNTED = ("n_frames", "n_samples")

Fingerprint = dict[str, Any]


def hashed(*parts: bytes) -> str:
    """First half of the SHA-256 of some bytes."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(part)
    return digest.hexdigest()[:32]


def of_clips(clips: Sequence[Clip]) -> Fingerprint:
    """Motion and sound of consecutive clips, and figures by which machines that differ are compared."""
    motion = np.concatenate([clip.motion.values for clip in clips])
    head = np.concatenate([clip.head.values for clip in clips])
    sound = np.concatenate([clip.speech.waveform.samples for clip in clips])
    return {
        "motion": hashed(",".join(clips[0].motion.channels).encode(), motion.tobytes(), head.tobytes()),
        "sound": hashed(sound.tobytes()),
        "n_frames": len(motion),
        "n_samples": len(sound),
        "means": [round(float(mean), 4) for mean in np.abs(motion).mean(axis=0)],
    }


def of_pictures(folder: Path) -> Fingerprint:
    """The PNG files of a folder, without their marks."""
    return {"pictures": hashed(*map(unmarked, sorted(folder.glob("*.png"))))}


def of_files(paths: Iterable[Path]) -> Fingerprint:
    """Files one by one, by name, without their marks."""
    return {"files": {path.name: hashed(unmarked(path)) for path in sorted(paths)}}


def environment() -> dict[str, str]:
    """What the bytes depend on besides the code: machine and versions of the libraries that compute."""
    return {"machine": f"{platform.machine()} {_processor()}"} | {name: _version(name) for name in DECIDES}


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "none"


def _processor() -> str:
    facts = Path("/proc/cpuinfo")
    if not facts.is_file():
        return platform.processor()
    lines = dict(line.split(":", 1) for line in facts.read_text().splitlines() if ":" in line)
    named = {key.strip(): value.strip() for key, value in lines.items()}
    wide = [
        flag
        for flag in ("avx2", "avx512f", "avx512_vnni", "avx512_bf16", "amx_tile")
        if flag in named.get("flags", "").split()
    ]
    return " ".join([named.get("vendor_id", ""), *wide])


def read_machines() -> list[dict[str, Any]]:
    """Records of all machines: the environment of each, and its fingerprints by the names of the requests."""
    machines: list[dict[str, Any]] = json.loads(KEPT.read_text(encoding="utf-8"))["machines"]
    return machines


def is_here(machine: Mapping[str, Any]) -> bool:
    """Whether a record was made where this process runs."""
    return bool(machine["environment"].items() <= environment().items())


def differences(found: Fingerprint, known: Fingerprint, *, is_same_machine: bool) -> list[str]:
    """What differs from a kept fingerprint: anything on the same machine, else figures beyond their tolerance."""
    if is_same_machine:
        here, there = _flat(found), _flat(known)
        return [
            f"{key} is {here.get(key)!s:.40}, not {there.get(key)!s:.40}"
            for key in here | there
            if here.get(key) != there.get(key)
        ]
    wrong = [
        f"{key} {found[key]}, not about {known[key]}"
        for key in COUNTED
        if key in known and abs(found[key] - known[key]) > SAMPLES * known[key]
    ]
    if "means" in known:
        here, there = np.array(found["means"]), np.array(known["means"])
        share = np.abs(here - there).sum() / there.sum() if here.shape == there.shape else np.inf
        wrong += [f"means differ by {share:.3f} of their sum"] if share > MEANS else []
    return wrong


def _flat(found: Fingerprint) -> Fingerprint:
    """Hashes of single files with the name of the file, in place of the objects that hold them."""
    return {
        f"{key} {name}".strip(): one
        for key, value in found.items()
        for name, one in (value.items() if isinstance(value, dict) else (("", value),))
    }


def renewed(machines: Sequence[Mapping[str, Any]], found: Mapping[str, Fingerprint]) -> list[dict[str, Any]]:
    """Records with the fingerprints of this machine; those of others remain only for requests that gave the same here.

    A request whose result has changed here has changed on the other machines, whose record of it is no longer true.
    """
    here = next((one["requests"] for one in machines if is_here(one)), {})
    changed = {name for name in found if name in here and here[name] != found[name]}
    others = [
        {"environment": one["environment"],
         "requests": {name: kept for name, kept in one["requests"].items() if name in found and name not in changed}}
        for one in machines
        if not is_here(one)
    ]  # fmt: skip
    return [{"environment": environment(), "requests": dict(found)}, *(one for one in others if one["requests"])]


def write_machines(machines: Sequence[Mapping[str, Any]]) -> None:
    """Write the records, one request a line."""
    blocks = []
    for one in machines:
        lines = ",\n".join(f"   {json.dumps(name)}: {json.dumps(kept)}" for name, kept in one["requests"].items())
        blocks.append(f'  {{"environment": {json.dumps(one["environment"])},\n   "requests": {{\n{lines}\n  }}}}')
    KEPT.write_text('{"machines": [\n' + ",\n".join(blocks) + "\n]}\n", encoding="utf-8")
