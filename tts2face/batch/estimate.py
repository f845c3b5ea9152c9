"""What a batch will take: hours of work and bytes on disk, before anything is rendered."""

from dataclasses import dataclass
from pathlib import Path

from tts2face.batch.manifest import is_current, read_manifest
from tts2face.batch.output import Plan
from tts2face.batch.segment import Segment
from tts2face.batch.store import Store
from tts2face.render.picture import Picture

# Measured on one core at 512 x 512 with 2 x 2 samples (docs/performance.md): seconds of drawing and encoding for each
# pixel sample of a frame, and of synthesis for each second of speech.
DRAW_S = 1 / 45 / (512 * 512 * 4)
SYNTHESIS_S = 0.15
BYTES_PER_PIXEL = 0.011  # of a frame, H.264 at CRF 18
SOUND_BYTES_PER_S = 96_000 + 16_000  # of a segment, and of the output


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is to be done: outputs, segments, seconds of clips, hours of one core, bytes of segments and outputs."""

    n_outputs: int
    n_stale: int
    n_segments: int
    n_missing: int
    seconds: float
    core_hours: float
    n_bytes: int


def estimate_batch(plan: Plan, out: Path, store: Store | None) -> Estimate:
    """Estimate of what a run of a plan takes; nothing is written."""
    entries = read_manifest(out)
    stale = [one for one in plan.outputs if not is_current(entries.get(one.name), one, out)]
    needed = {segment.address: segment for output in stale for segment in output.needed}
    missing = [segment for address, segment in needed.items() if store is None or store.result(address) is None]
    fps = plan.outputs[0].fps if plan.outputs else 30.0
    work = sum(_core_seconds(segment, fps) for segment in missing)
    n_bytes = sum(_n_bytes(segment, fps) for segment in missing)
    n_bytes += sum(_n_bytes(segment, fps) for output in stale for segment in output.segments)
    seconds = sum(_n_frames(segment) for output in stale for segment in output.segments) / fps
    return Estimate(
        len(plan.outputs), len(stale), len(plan.segments), len(missing), seconds, work / 3600.0, int(n_bytes)
    )


def _n_frames(segment: Segment) -> int:
    if segment.fills_slot and segment.slot_frames is not None:
        return segment.slot_frames
    return segment.window_frames


def _core_seconds(segment: Segment, fps: float) -> float:
    picture = Picture(**segment.picture)
    samples = picture.width * picture.height * picture.supersampling**2
    n_frames = _n_frames(segment)
    return n_frames * samples * DRAW_S + n_frames / fps * SYNTHESIS_S


def _n_bytes(segment: Segment, fps: float) -> float:
    picture = Picture(**segment.picture)
    n_frames = _n_frames(segment)
    return n_frames * picture.width * picture.height * BYTES_PER_PIXEL + n_frames / fps * SOUND_BYTES_PER_S
