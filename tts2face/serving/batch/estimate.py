"""Estimate of a batch: seconds of work and bytes on disk, before anything is rendered."""

from dataclasses import dataclass
from pathlib import Path

from tts2face.picture.options import Picture
from tts2face.serving.batch.manifest import is_current, read_manifest
from tts2face.serving.batch.output import Output, Plan
from tts2face.serving.batch.segment import TRACK, Segment
from tts2face.serving.batch.store import Store

# Seconds of one core, measured at 256 x 256 to 1280 x 720 (docs/performance.md): for each frame, for each pixel sample
# of the square that holds the head, for each pixel of the picture, for each second of speech, and to load the models.
FRAME_S = 4.3e-3
# seconds of a sample of a picture
SAMPLE_S = 11.6e-9
# seconds of a pixel, drawn and encoded
PIXEL_S = 22e-9
# seconds of a second of speech
SYNTHESIS_S = 0.15
# seconds until a process renders
START_S = 5.0
FRAME_BYTES, PIXEL_BYTES = 1000, 0.003  # of a frame, H.264 at CRF 18
SOUND_BYTES_PER_S, OUTPUT_SOUND_BYTES_PER_S = 96_000, 16_000  # of a segment, and of an output
TRACK_BYTES_PER_S = 200_000  # of a segment for exports; an export is about half of it


@dataclass(frozen=True, slots=True)
class Estimate:
    """Extent of a batch: outputs, segments, seconds of clips, seconds of one core, bytes of segments and outputs."""

    n_outputs: int
    n_stale: int
    n_segments: int
    n_missing: int
    seconds: float
    core_s: float
    n_bytes: int


def estimate_batch(plan: Plan, out: Path, store: Store | None) -> Estimate:
    """Estimate of what a run of a plan takes; nothing is written."""
    entries = read_manifest(out)
    stale = [output for output in plan.outputs if not is_current(entries.get(output.name), output, out)]
    needed = {segment.address: segment for output in stale for segment in output.needed}
    missing = [segment for address, segment in needed.items() if store is None or store.result(address) is None]
    fps = plan.outputs[0].fps if plan.outputs else 30.0
    work = sum(_core_seconds(segment, fps) for segment in missing)
    work += START_S if missing else 0.0
    n_bytes = sum(_n_bytes(segment, fps, SOUND_BYTES_PER_S) for segment in missing)
    n_bytes += sum(_output_bytes(output) for output in stale)
    seconds = sum(_n_frames(segment) for output in stale for segment in output.segments) / fps
    return Estimate(len(plan.outputs), len(stale), len(plan.segments), len(missing), seconds, work, int(n_bytes))


def _n_frames(segment: Segment) -> int:
    if segment.fills_slot and segment.slot_frames is not None:
        return segment.slot_frames
    return segment.window_frames


def _core_seconds(segment: Segment, fps: float) -> float:
    n_frames = _n_frames(segment)
    synthesis = n_frames / fps * SYNTHESIS_S
    if segment.medium == TRACK:
        return synthesis
    picture = Picture(**segment.picture)
    samples = min(picture.width, picture.height) ** 2 * picture.samples_per_side**2
    return synthesis + n_frames * (FRAME_S + samples * SAMPLE_S + picture.width * picture.height * PIXEL_S)


def _n_bytes(segment: Segment, fps: float, sound_bytes_per_s: float) -> float:
    n_frames = _n_frames(segment)
    if segment.medium == TRACK:
        return n_frames / fps * TRACK_BYTES_PER_S
    picture = Picture(**segment.picture)
    in_frame = FRAME_BYTES + picture.width * picture.height * PIXEL_BYTES
    return n_frames * in_frame + n_frames / fps * sound_bytes_per_s


def _output_bytes(output: Output) -> float:
    seconds = sum(_n_frames(segment) for segment in output.segments) / output.fps
    movies = output.segments if output.suffix else ()
    n_bytes = sum(_n_bytes(segment, output.fps, OUTPUT_SOUND_BYTES_PER_S) for segment in movies)
    return n_bytes + len(output.exports) * seconds * TRACK_BYTES_PER_S / 2
