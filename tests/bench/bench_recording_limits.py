"""Distributions of the quality measures of recordings: as they are, damaged, desynchronised, and with wrong sound.

Run: ``PYTHONPATH=. python tests/bench/bench_recording_limits.py RECORDINGS [--others FOLDER] [--cache FOLDER]
[--n N]``. RECORDINGS and FOLDER are folders of short recordings with transcripts, of one person and of several. Sounds
are damaged and aligned again, landmarks stay; pictures of every eighth recording are damaged and tracked again. Prints
the tables that decision 129 sums up. ``effect``: a talker of the damaged recordings, evaluated on every third, with
true phones.
"""

import argparse
import io
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import av
import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.methods import build_methods
from corpus_tools.measures.reference import LipCurves
from corpus_tools.recordings.expected_opening import shipped_talker_opening
from corpus_tools.recordings.folder import Recording, find_recordings, pronounce_recording
from corpus_tools.recordings.limits import check_limits, landmark_measures, sound_measures
from corpus_tools.recordings.observation import Observation, trim_to_picture
from corpus_tools.recordings.observe import observe
from corpus_tools.recordings.sound import SOUND_RATE, AlignedSpeech
from corpus_tools.recordings.sync import LAGS_S, NEAR_S, lag_correlations
from corpus_tools.run_options import RunOptions
from corpus_tools.studies.evaluation.evaluate import EVALUATION_METADATA
from corpus_tools.training.train_talker import learn_talker
from lexicon.errors import DataError
from lexicon.sequence import PhoneSequence
from tts2face.lips.motion_measures import correlation, speech_frames
from tts2face.models.landmarks import lip_opening
from tts2face.sound.alignment import Aligner
from tts2face.types import Waveform
from tts2face.video.media import TimedFrame, read_frames, read_sound
from tts2face.video.networks import find_bundle
from tts2face.video.pose import remove_pose
from tts2face.video.resampling import trim_and_fill
from tts2face.video.streaming import StreamingTracker

Samples = NDArray[np.float32]
Pictures = list[NDArray[np.uint8]]
RNG = np.random.default_rng(0)
EVERY_PICTURE = 8
MIN_FOR_TALKER = 20  # recordings, below which no talker is learnt of them
LAGS_MS = (-400, -200, -80, -40, 40, 80, 200, 400)
ECHO_S, ECHO_LEVEL = 0.6, 0.7  # reverberation time of a room, level of its echo over the direct sound
QUANTILES = (0.01, 0.05, 0.5, 0.95, 0.99)


def add_noise(sound: Samples, below_db: float) -> Samples:
    """Pink noise so far below the speech, whose level is that of the 20 ms windows within 30 dB of the loudest."""
    spectrum = np.fft.rfft(RNG.normal(size=len(sound)))
    spectrum /= np.sqrt(np.maximum(np.fft.rfftfreq(len(sound), 1 / SOUND_RATE), 50.0))
    noise = np.fft.irfft(spectrum, len(sound))
    levels = np.sqrt(np.square(sound[: len(sound) // 320 * 320].reshape(-1, 320)).mean(axis=1))
    speech = np.sqrt(np.square(levels[levels > levels.max() * 10**-1.5]).mean())
    return np.asarray(sound + noise / noise.std() * speech * 10 ** (-below_db / 20), np.float32)


def add_echo(sound: Samples) -> Samples:
    """Exponentially decaying noise as the response of a room."""
    times = np.arange(SOUND_RATE // 2) / SOUND_RATE
    response = RNG.normal(size=len(times)) * 10 ** (-3 * times / ECHO_S)
    response *= ECHO_LEVEL / np.sqrt(np.square(response).sum())
    response[0] = 1.0
    return np.convolve(sound, response)[: len(sound)].astype(np.float32)


def through_codec(sound: Samples, container_format: str, codec: str) -> Samples:
    """Encoded with 64 kb/s at 44.1 kHz and decoded, not longer than before."""
    import soxr

    buffer = io.BytesIO()
    with av.open(buffer, "w", format=container_format) as container:
        stream = container.add_stream(codec, rate=44_100, layout="mono")
        stream.bit_rate = 64_000
        frame = av.AudioFrame.from_ndarray(soxr.resample(sound, SOUND_RATE, 44_100)[None], "fltp", "mono")
        frame.sample_rate = 44_100
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    buffer.seek(0)
    with av.open(buffer, "r") as encoded:
        blocks = [block.to_ndarray()[0] for block in encoded.decode(audio=0)]
    decoded = soxr.resample(np.concatenate(blocks), 44_100, SOUND_RATE)
    return np.asarray(decoded[: len(sound)], np.float32)


def through_mp3(sound: Samples) -> Samples:
    """Encoded as MP3 with 64 kb/s and decoded."""
    return through_codec(sound, "mp3", "libmp3lame")


SOUND_DAMAGES: dict[str, Callable[[Samples], Samples]] = {
    "as recorded": lambda sound: sound,
    "noise at -20 dB": lambda sound: add_noise(sound, 20),
    "noise at -15 dB": lambda sound: add_noise(sound, 15),
    "noise at -10 dB": lambda sound: add_noise(sound, 10),
    "noise at -5 dB": lambda sound: add_noise(sound, 5),
    "noise at 0 dB": lambda sound: add_noise(sound, 0),
    "MP3, 64 kb/s": through_mp3,
    "room echo": add_echo,
    "echo, noise at -10 dB, MP3": lambda sound: through_mp3(add_noise(add_echo(sound), 10)),
    "clipped at 1/4": lambda sound: np.clip(4 * sound / np.abs(sound).max(), -1, 1),
    "clipped at 1/16": lambda sound: np.clip(16 * sound / np.abs(sound).max(), -1, 1),
}


def darken(pictures: Pictures, factor: float) -> Pictures:
    """Darker pictures with noise of four levels."""
    return [np.clip(one * factor + RNG.normal(0, 4, one.shape), 0, 255).astype(np.uint8) for one in pictures]


def shrink(pictures: Pictures, divisor: int) -> Pictures:
    """Smaller pictures: means of squares."""
    found = []
    for one in pictures:
        height, width = (side // divisor * divisor for side in one.shape[:2])
        blocks = one[:height, :width].reshape(height // divisor, divisor, width // divisor, divisor, 3)
        found.append(np.ascontiguousarray(blocks.mean(axis=(1, 3)).astype(np.uint8)))
    return found


PICTURE_DAMAGES: dict[str, Callable[[Pictures], Pictures]] = {
    "as recorded": lambda pictures: pictures,
    "1/2 of the size": lambda pictures: shrink(pictures, 2),
    "1/4 of the size": lambda pictures: shrink(pictures, 4),
    "1/6 of the size": lambda pictures: shrink(pictures, 6),
    "1/5 of the light": lambda pictures: darken(pictures, 0.2),
    "1/12 of the light": lambda pictures: darken(pictures, 0.08),
}


def align_damaged(
    recording: Recording, seen: Observation, damage: Callable[[Samples], Samples], aligner: Aligner
) -> tuple[Observation, dict[str, float]]:
    """The observation with phones aligned to the damaged sound, and its measures."""
    samples = np.clip(damage(read_sound(recording.video, SOUND_RATE).samples.copy()), -1, 1).astype(np.float32)
    sound = Waveform(samples, SOUND_RATE)
    found = aligner.align(sound, pronounce_recording(recording) or (), may_lack=True)
    fit = found.fit.share
    aligned = AlignedSpeech(found.phones, found.words, fit, found.mismatches, sound, is_recognised=False)
    phones, words = trim_to_picture(aligned, 0.0, len(seen.landmarks) / seen.fps)
    measures = {"fit": fit, **sound_measures(sound, found.phones)}
    return replace(seen, phones=phones, words=words), measures


def sync_of_pools(curves: NDArray[np.float64], n: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Highest correlation and its lag in ms of 200 random groups of n curves."""
    groups = [curves[RNG.choice(len(curves), n, replace=len(curves) < 2 * n)].mean(axis=0) for _ in range(200)]
    lags = LAGS_S[[int(one.argmax()) for one in groups]]
    return np.array([one.max() for one in groups]), np.asarray(1000 * lags, np.float64)


def quantiles(values: Sequence[float] | NDArray[np.float64], digits: int) -> str:
    """Quantiles of a measure in one cell."""
    return " ".join(f"{value:.{digits}f}" for value in np.quantile(np.asarray(values, np.float64), QUANTILES))


def effect(learnt: Sequence[Observation], true: Sequence[Observation]) -> str:
    """r of opening and width of the true every third utterance, by a talker of the other learnt ones."""
    tested = {one.name for one in true[::3]}
    known = [one for one in learnt if one.name not in tested]
    talker = learn_talker(known, metadata=EVALUATION_METADATA)
    motion = build_methods(talker)["exemplar"]
    real, made = [], []
    for one in true[::3]:
        here = speech_frames(one.phones, len(one.landmarks), one.fps)
        real.append(LipCurves.of(one.landmarks[here]).values())
        shapes = talker.model.shapes(motion(one.phones, len(one.landmarks), one.fps)[here])
        made.append(LipCurves.of(shapes).values())
    pooled, predicted = np.concatenate(real), np.concatenate(made)
    return " / ".join(f"{correlation(pooled[:, at], predicted[:, at]):.3f}" for at in range(2))


def sound_rows(recordings: dict[str, Recording], seen: Sequence[Observation]) -> Iterator[str]:
    """Rows of the table of damaged sounds."""
    aligner = Aligner()
    for name, damage in SOUND_DAMAGES.items():
        learnt, measured, refused = [], [], 0
        for one in seen:
            try:
                again, measures = align_damaged(recordings[one.name], one, damage, aligner)
                learnt.append(again)
                measured.append(measures)
                check_limits(measures)
            except DataError:
                refused += 1
        curves = np.array([lag_correlations(one, shipped_talker_opening) for one in learnt])
        near = curves[:, np.abs(LAGS_S) <= NEAR_S].max(axis=1)
        yield (
            f"| {name} | {quantiles([one['snr_db'] for one in measured], 0)} "
            f"| {quantiles([one['fit'] for one in measured], 2)} "
            f"| {np.mean([one['clipped'] for one in measured]):.1%} | {quantiles(near, 2)} "
            f"| {curves.mean(axis=0).max():.2f} | {refused} of {len(seen)} "
            f"| {effect(learnt, seen) if len(seen) > MIN_FOR_TALKER else ''} |"
        )


def sync_rows(name: str, seen: Sequence[Observation]) -> Iterator[str]:
    """Rows of the table of synchronous and wrong sounds, and of known lags."""
    right = np.array([lag_correlations(one, shipped_talker_opening) for one in seen])
    others = [
        replace(one, phones=other.phones)
        for one in seen
        for other in seen
        if other.phones.phones != one.phones.phones and abs(other.phones.end - one.phones.end) < 0.5
    ]
    chosen = RNG.permutation(len(others))[:300]
    wrong = np.array([lag_correlations(others[at], shipped_talker_opening) for at in chosen])
    for label, curves in (("right", right), ("wrong", wrong)):
        near = curves[:, np.abs(LAGS_S) <= NEAR_S].max(axis=1)
        pools = [sync_of_pools(curves, n) for n in (4, 8, 16)]
        cells = [f"{quantiles(best, 2)}; {lags.std():.0f} ms" for best, lags in pools]
        yield f"| {name}, {label} sound | {quantiles(near, 2)} | {' | '.join(cells)} |"
    shifted = []
    for lag in LAGS_MS:
        late = [replace(one, phones=delay_phones(one, lag / 1000)) for one in seen]
        curve = np.array([lag_correlations(one, shipped_talker_opening) for one in late]).mean(axis=0)
        shifted.append(f"{lag:+d}: {1000 * LAGS_S[curve.argmax()]:+.0f}")
    yield f"{name}, known and estimated lags in ms: {', '.join(shifted)}"


def harm_rows(seen: Sequence[Observation]) -> Iterator[str]:
    """What a talker loses by recordings with the sound of others, and by delayed ones."""
    others = [
        next(
            other
            for other in (*seen[at + 1 :], *seen)
            if other.phones.phones != one.phones.phones and other.phones.end < one.phones.end + 0.2
        )
        for at, one in enumerate(seen)
    ]
    for share in (0.1, 0.3, 1.0):
        is_wrong = RNG.random(len(seen)) < share
        mixed = [
            replace(one, phones=other.phones, words=()) if wrong else one
            for one, other, wrong in zip(seen, others, is_wrong, strict=True)
        ]
        yield f"{share:.0%} with another sentence's sound: {effect(mixed, seen)}"
    for lag in (0.04, 0.08, 0.2, 0.4):
        late = [replace(one, phones=delay_phones(one, lag)) for one in seen]
        yield f"sound later by {1000 * lag:.0f} ms, not corrected: {effect(late, seen)}"


def delay_phones(one: Observation, lag: float) -> PhoneSequence:
    """The phones later by `lag` seconds; the silence before them becomes longer or shorter."""
    edges = one.phones.edges + lag
    edges[0] = 0.0
    return PhoneSequence(one.phones.phones, edges) if edges[1] > 0 else one.phones


def lip_correlations(one: Observation, landmarks: NDArray[np.float32], first: int) -> list[float]:
    """r of opening and width of landmarks that begin at a frame of a recording against those of the recording."""
    n_frames = min(len(landmarks), len(one.landmarks) - first)
    pair = [LipCurves.of(part).values() for part in (one.landmarks[first:][:n_frames], landmarks[:n_frames])]
    return [correlation(pair[0][:, at], pair[1][:, at]) for at in range(2)]


class Retracked(NamedTuple):
    """Damaged pictures, their points (T, P, 2); from the frame `first` on filled points and landmarks without pose."""

    frames: list[TimedFrame]
    points: NDArray[np.float32]
    filled: NDArray[np.float32]
    landmarks: NDArray[np.float32]
    first: int


def retrack(one: Observation, damage: Callable[[Pictures], Pictures], tracker: StreamingTracker) -> Retracked | None:
    """A recording tracked in damaged pictures; None if the face is lost."""
    recorded = list(read_frames(one.video))
    pictures = damage([frame.pixels for frame in recorded])
    frames = [TimedFrame(frame.time, pixels) for frame, pixels in zip(recorded, pictures, strict=True)]
    points = np.array([found.points for found in tracker.track(frames, one.fps)])
    try:
        filled, first, _ = trim_and_fill(points, one.fps)
    except DataError:
        return None
    return Retracked(frames, points, filled, remove_pose(filled, one.fps).landmarks, first)


def picture_rows(seen: Sequence[Observation]) -> Iterator[str]:
    """Rows of the table of damaged pictures."""
    tracker = StreamingTracker(find_bundle(None))
    for name, damage in PICTURE_DAMAGES.items():
        rows, lost = [], 0
        for one in seen:
            made = retrack(one, damage, tracker)
            if made is None:
                lost += 1
                continue
            found = lip_correlations(one, made.landmarks, made.first)
            measures = landmark_measures(made.filled, made.landmarks)
            rows.append((measures["eye_px"], measures["jitter"], *found, float(lip_opening(made.landmarks).min())))
        table = np.array(rows)
        low, median, high = np.quantile(table, [0, 0.5, 1], axis=0)
        yield (
            f"| {name} | {median[0]:.0f} | {median[1]:.2f}, {high[1]:.2f} | {median[2]:.3f}, {low[2]:.3f} "
            f"| {median[3]:.3f}, {low[3]:.3f} | {median[4]:.3f} | {lost} of {len(seen)} |"
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("recordings", type=Path)
    parser.add_argument("--others", type=Path)
    parser.add_argument("--cache", type=Path)
    parser.add_argument("--n", type=int, default=60)
    chosen = parser.parse_args()
    for folder in filter(None, (chosen.recordings, chosen.others)):
        seen = observe(folder, run_options=RunOptions(chosen.cache, 1)).kept[: chosen.n]
        recordings = {one.name: one for one in find_recordings(folder)}
        print(f"\n{folder.name}: quantiles 1, 5, 50, 95, 99 %", flush=True)
        pictures = seen[::EVERY_PICTURE] if len(seen) > EVERY_PICTURE else seen
        tables = [sync_rows(folder.name, seen), sound_rows(recordings, seen), picture_rows(pictures)]
        for row in chain(*tables, harm_rows(seen) if len(seen) > MIN_FOR_TALKER else ()):
            print(row, flush=True)


if __name__ == "__main__":
    main()
