"""Time and memory of importing characters: python tests/bench/bench_character.py [--profile].

Each import runs in a process of its own, which prints its seconds and its peak memory.
"""

import argparse
import cProfile
import pstats
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

CASES = ("head, landmarks given", "head, tracked", "58,000 vertices, landmarks given", "58,000 vertices, tracked")
N_PROFILED = 25


def make(folder: Path) -> None:
    """Write the shipped head and its skin with four times the triangles as characters."""
    from tests.interchange.characters.build.test_dense import dense_head
    from tests.interchange.characters.made import Variant, write_character_file, write_landmarks

    write_character_file(folder / "head.glb")
    write_character_file(folder / "dense.glb", Variant(is_dense=True), face=dense_head())
    write_landmarks(folder / "landmarks.tsv")


def measure(folder: Path, case: str, is_profiled: bool) -> None:
    """Import one case and print its figures."""
    from tts2face.interchange.characters.importing import import_face
    from tts2face.interchange.characters.saving import save_face

    character = folder / ("dense.glb" if case.startswith("58") else "head.glb")
    landmarks = folder / "landmarks.tsv" if case.endswith("given") else None
    profile = cProfile.Profile(builtins=False)
    began, cpu = time.perf_counter(), time.process_time()
    if is_profiled:
        profile.enable()
    imported = import_face(character, landmarks=landmarks)
    if is_profiled:
        profile.disable()
        pstats.Stats(profile).sort_stats("cumulative").print_stats(N_PROFILED)
    spent, cpu = time.perf_counter() - began, time.process_time() - cpu
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    began = time.perf_counter()
    save_face(folder / "me.face", imported.face)
    saved = time.perf_counter() - began
    print(f"| {case} | {len(imported.face.vertices)} | {spent:.1f} | {cpu:.1f} | {saved:.1f} | {peak:.2f} |")


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--profile", action="store_true")
    parser.add_argument("--measure", nargs=2, metavar=("FOLDER", "CASE"))
    options = parser.parse_args()
    sys.path.insert(0, str(Path(__file__).parents[2]))
    if options.measure:
        measure(Path(options.measure[0]), options.measure[1], options.profile)
        return
    with tempfile.TemporaryDirectory() as folder:
        make(Path(folder))
        print("| character | vertices | import, s | of CPU | saving, s | peak memory, GB |")
        print("| --- | --- | --- | --- | --- | --- |", flush=True)
        for case in CASES:
            command = [sys.executable, __file__, "--measure", folder, case] + ["--profile"] * options.profile
            subprocess.run(command, check=True)


if __name__ == "__main__":
    main()
