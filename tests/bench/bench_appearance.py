"""Appearance models on recordings held out: modes, errors, quality, seconds of every stage, speed of drawing.

Run: ``python tests/bench/bench_appearance.py ../shared/recordings/grid_s1 --learn 300 --hold-out 50``.
"""

import argparse
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from corpus_tools.appearance.train import learn_appearance
from corpus_tools.appearance.videos import build_appearance_recording
from corpus_tools.recordings.observe import observe
from corpus_tools.recordings.video import CachedTracker
from corpus_tools.run_options import RunOptions
from corpus_tools.training.train_talker import learn_talker
from tests.bench.appearance_measures import measure_appearance
from tts2face.models.talker_file import write_talker
from tts2face.picture.options import Picture
from tts2face.picture.own_face import draw_video_frame, own_face_renderer
from tts2face.video.networks import find_bundle


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--learn", type=int, default=300)
    parser.add_argument("--hold-out", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--cache", type=Path)
    options = parser.parse_args()
    began = time.perf_counter()

    def stage(what: str) -> None:
        nonlocal began
        print(f"{what}: {time.perf_counter() - began:.1f} s")
        began = time.perf_counter()

    kept = observe(options.recordings, run_options=RunOptions(options.cache)).kept
    stage("observing (from the cache where it was done before)")
    order = np.random.default_rng(options.seed).permutation(len(kept))
    learn = [kept[i] for i in order[: options.learn]]
    held_out = [kept[i] for i in order[options.learn : options.learn + options.hold_out]]
    about = dict.fromkeys(("name", "language", "sources", "licence", "attribution", "command", "created"), "")
    talker = learn_talker(learn, metadata=about)
    stage("shape model")
    eyes = CachedTracker(RunOptions(options.cache).folder(), find_bundle())
    films = [
        build_appearance_recording(seen, spoken.shape, eyes)
        for seen, spoken in zip(learn, talker.utterances, strict=True)
    ]
    learnt = learn_appearance(films)
    stage(f"appearance of {len(films)} recordings")
    unseen = [build_appearance_recording(seen, talker.model.parameters(seen.landmarks), eyes) for seen in held_out]
    for name, value in measure_appearance(films, learnt, unseen, kept).as_dict().items():
        print(f"{name}: {value}")
    stage("measuring")
    spoken = tuple(
        replace(one, appearance_parameters=looks)
        for one, looks in zip(talker.utterances, learnt.parameters, strict=True)
    )
    whole = replace(talker, utterances=spoken, appearance=learnt.appearance)
    path = Path("/tmp/bench_appearance.talker")
    write_talker(path, whole)
    print(f"talker file: {path.stat().st_size / 1e6:.1f} MB")
    path.unlink()
    for size in ("360x288", "512x512"):
        made = own_face_renderer(whole, Picture(size=size))
        motion = np.concatenate([spoken[0].shape[30, :20], spoken[0].appearance_parameters[30]])
        draw_video_frame(made, motion, 0)
        began = time.perf_counter()
        for number in range(len(made.plate)):
            draw_video_frame(made, motion, number)
        print(f"drawing at {size}, one thread: {len(made.plate) / (time.perf_counter() - began):.0f} frames/s")


if __name__ == "__main__":
    main()
