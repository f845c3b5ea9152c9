"""Accuracy and speed of cloning motion between talkers (Theobald et al. 2007, eq. 5).

Run: ``PYTHONPATH=. python tests/bench/bench_clone.py RECORDINGS [--cache FOLDER]``. The source is the starter talker
grid_s1. There is one recorded person, so second talkers are learnt from the two halves of RECORDINGS, with other
numbers of modes, and from the landmarks of the shipped faces while they speak the source's utterances with brows and
eyelids that move by themselves. Closed: at the frame of a bilabial where the middle lip points are nearest, they are
less than 1 % of the distance of the outer eye corners apart, as in `corpus_tools.training.train_talker`. The rule for
lips that touch has the same threshold, so that closures are also counted before it.
"""

import argparse
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from corpus_tools.recordings.observation import Observation, Quality
from corpus_tools.recordings.observe import observe
from corpus_tools.run_options import RunOptions
from corpus_tools.training.train_talker import CLOSED_GAP, learn_shapes
from tests.bench.bench_retarget import bilabial_frames, landmarks_of, opening
from tts2face.lips.cloning import ParameterTransfer, append_missing_components, build_parameter_transfer
from tts2face.lips.lip_gaps import facing_gaps
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face_loading import load_face
from tts2face.models.landmarks import MOUTH_REGION, lip_opening
from tts2face.models.talker import ShapeModel, Talker
from tts2face.models.talker_file import load_talker

Floats = NDArray[np.float64]

N_FRAMES = 100  # compared with least squares
EVERY = 8  # utterance of the source is cloned


def observe_face(talker: Talker, name: str) -> list[Observation]:
    """A shipped face that speaks the talker's utterances, observed without error; brows and eyelids move, too."""
    face = load_face(name)
    ready, rng = build_retargeter(talker, face), np.random.default_rng(0)
    free = [i for i, shape in enumerate(face.shape_names) if shape.startswith(("brow", "eyeBlink", "eyeWide", "cheek"))]
    found = []
    for utterance in talker.utterances[1::EVERY]:
        weights = ready.retarget(talker.speech_trajectory(utterance)).values.astype(np.float64)
        times = np.arange(len(weights))[:, None] / talker.fps
        waves = np.sin(times * rng.uniform(2, 9, len(free)) + rng.uniform(0, 7, len(free)))
        weights[:, free] = np.maximum(waves, 0.0) * rng.uniform(0.1, 0.6, len(free))
        shapes, n = landmarks_of(face, weights).astype(np.float32), len(weights)
        found.append(
            Observation(utterance.name, talker.fps, shapes, np.zeros((n, 6), np.float32), utterance.phones, (),
                        utterance.intensity, Quality(0.0, 1.0, 0, 0.0), Path(name))
        )  # fmt: skip
    return found


def targets(recordings: Path, cache: Path | None, talker: Talker) -> Iterator[tuple[str, ShapeModel]]:
    """Second talkers by name."""
    kept = observe(recordings, run_options=RunOptions(cache, 1)).kept
    yield "even half, 12 + 6 modes", learn_shapes(kept[::2], 12, 6)
    yield "odd half, 30 + 15 modes", learn_shapes(kept[1::2], 30, 15)
    for name in ("head", "ada"):
        yield f"{name}, 20 + 10 modes", learn_shapes(observe_face(talker, name), 20, 10)


def distance(one: NDArray[np.floating], other: NDArray[np.floating]) -> Floats:
    """(T,) root mean square distance of the mouth's landmarks, mm."""
    squares = ((one - other)[:, list(MOUTH_REGION)].astype(np.float64) ** 2).sum(axis=2)
    return np.asarray(np.sqrt(squares.mean(axis=1)), np.float64)


def least_squares(
    source: ShapeModel, target: ShapeModel, values: NDArray[np.float32], ready: ParameterTransfer
) -> Floats:
    """(T, q) displacements from rest by full least squares on all landmark coordinates."""
    moved = values.astype(np.float64) - ready.source_rest
    wanted = np.tensordot(moved, source.basis.astype(np.float64), axes=1) * ready.size
    design = target.basis.reshape(len(target.basis), -1).T.astype(np.float64)
    return np.asarray(np.linalg.lstsq(design, wanted.reshape(len(values), -1).T, rcond=None)[0].T, np.float64)


def closure_share(talker: Talker, shapes: list[NDArray[np.float32]], at: list[list[int]]) -> float:
    """Share of bilabials with closed lips."""
    gaps = [lip_opening(one[frames]) * np.sign(opening(one[frames])) for one, frames in zip(shapes, at, strict=True)]
    return float((np.concatenate(gaps) < CLOSED_GAP).mean())


def there_and_back(
    source: ShapeModel, back: ParameterTransfer, values: NDArray[np.float32], mapped: tuple[Floats, NDArray[np.float32]]
) -> tuple[Floats, Floats]:
    """(T,) distances from the source of what comes back by eq. 5 alone, and with limits and lips."""
    by_rule, all_done = back.clone_unlimited(mapped[0]), back.parameters(mapped[1])
    wanted = source.shapes(values)
    return distance(source.shapes(by_rule), wanted), distance(source.shapes(all_done), wanted)


def report(talker: Talker, name: str, target: ShapeModel, gain: float = 1.0) -> None:
    """Print the figures of one target."""
    source, utterances = talker.model, talker.utterances[::EVERY]
    values = np.concatenate([utterance.shape for utterance in utterances])
    ready = build_parameter_transfer(source, target, gain=gain)
    began = time.perf_counter()
    mapped = ready.parameters(values)
    spent = time.perf_counter() - began
    some = np.linspace(0, len(values) - 1, N_FRAMES).astype(int)
    wanted = ready.clone_unlimited(values)
    apart = wanted[some] - ready.target_rest - gain * least_squares(source, target, values[some], ready)
    spans = np.cumsum([len(utterance.shape) for utterance in utterances])[:-1]
    before, after = np.split(source.shapes(values), spans), np.split(target.shapes(mapped), spans)
    at = [bilabial_frames(u, opening(one), talker.fps) for u, one in zip(utterances, before, strict=True)]
    lines = facing_gaps(target)
    held = np.clip(wanted, -ready.limits, ready.limits)
    crossing = (held @ lines[:, :-1].T + lines[:, -1] < 0).any(axis=1)
    parted = distance(target.shapes(mapped), target.shapes(held))
    changed = np.any(np.abs(mapped - held) > 1e-3, axis=1)
    kept_back = distance(target.shapes(held), target.shapes(wanted))
    limited = np.abs(wanted) > ready.limits
    linear, returned = there_and_back(
        source, build_parameter_transfer(target, source, gain=1 / gain), values, (wanted, mapped)
    )
    kept = ((ready.relation[:, : source.n_speech] / (gain * ready.size)) ** 2).sum(axis=0)
    share = (kept * source.spread[: source.n_speech] ** 2).sum() / (source.spread[: source.n_speech] ** 2).sum()
    open_ = [np.concatenate([opening(one) for one in parts]) for parts in (before, after)]
    print(f"\n{name}, gain {gain:g}: size {ready.size:.3f}, {len(values)} frames")
    print(f"  mouth variance that the target can show {share:.2%}")
    print(f"  eq. 5 against least squares, {N_FRAMES} frames: {np.abs(apart).max():.1e} mm at most")
    print(f"  there and back, mouth landmarks: {linear.mean():.3f} mm (95 %: {np.percentile(linear, 95):.3f}), "
          f"{returned.mean():.3f} mm (95 %: {np.percentile(returned, 95):.3f}) with limits and lips")  # fmt: skip
    beyond, in_mouth = limited.any(axis=1).mean(), limited[:, : target.n_speech].any(axis=1).mean()
    print(
        f"  beyond the limits: {beyond:.1%} of frames ({in_mouth:.1%} in the mouth), {limited.mean():.2%} of parameters"
    )
    print(f"  after: {(np.abs(mapped) > ready.limits).sum()}; the limits move the mouth by {kept_back.mean():.3f} mm")
    reached = mapped.astype(np.float64) @ lines[:, :-1].T + lines[:, -1]
    print(
        f"  lips cross in {crossing.mean():.1%} of frames; after: {(reached < 0).sum()}, least {reached.min():.3f} mm"
    )
    print(f"  lips set right in {changed.mean():.1%}, by {parted[changed].mean():.3f} mm (most {parted.max():.2f})")
    from_mean = values @ ready.relation.T
    ways = {"eq. 5 from rest": wanted, "eq. 5 from the mean": from_mean, "within limits": held, "all": mapped}
    shares = [
        f"{way} {closure_share(talker, np.split(target.shapes(one), spans), at):.3f}" for way, one in ways.items()
    ]
    print(
        f"  {sum(map(len, at))} bilabials closed: source {closure_share(talker, before, at):.3f}, {', '.join(shares)}"
    )
    print(f"  opening: r {np.corrcoef(*open_)[0, 1]:.4f}, slope {np.polyfit(*open_, 1)[0]:.3f}; "
          f"{len(values) / spent:.0f} frames/s")  # fmt: skip


def main() -> None:
    """Make the talkers and report."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--cache", type=Path)
    arguments = parser.parse_args()
    talker = load_talker("grid_s1")
    report(talker, "itself", talker.model)
    for name, model in targets(arguments.recordings, arguments.cache, talker):
        report(talker, name, model)
        joined = append_missing_components(talker.model, model)
        report(talker, f"{name}, {len(joined.spread) - len(model.spread)} appended", joined)
        report(talker, name, model, gain=1.3)


if __name__ == "__main__":
    main()
