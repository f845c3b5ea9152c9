"""The loudness meter of FFmpeg (filter ``ebur128``), through PyAV: an implementation that shares no code with ours."""

import av
import numpy as np
from av.filter import Graph

from tts2face.sound.loudness import SILENT_DB, oversampled_peaks
from tts2face.types import Waveform


def measure_loudness(sound: Waveform) -> tuple[float, float]:
    """Integrated loudness in LUFS, and true peak in dB of full scale."""
    graph = Graph()
    source = graph.add(
        "abuffer", f"sample_rate={sound.rate}:sample_fmt=flt:channel_layout=mono:time_base=1/{sound.rate}"
    )
    meter, sink = graph.add("ebur128", "metadata=1:peak=true"), graph.add("abuffersink")
    source.link_to(meter)
    meter.link_to(sink)
    graph.configure()
    frame = av.AudioFrame.from_ndarray(sound.samples[None].copy(), format="flt", layout="mono")
    frame.sample_rate, frame.pts = sound.rate, 0
    graph.push(frame)
    graph.push(None)
    found: dict[str, str] = {}
    while True:
        try:
            found = dict(graph.pull().metadata) or found  # the last frame may be too short to have any
        except (av.error.EOFError, av.error.BlockingIOError):
            break
    return float(found["lavfi.r128.I"]), 20 * float(np.log10(float(found["lavfi.r128.true_peak"])))


def true_peak(sound: Waveform) -> float:
    """Largest level of the continuous signal in dB of full scale, by fourfold oversampling (annex 2)."""
    return 20.0 * float(np.log10(max(float(oversampled_peaks(sound.samples).max(initial=0.0)), 10 ** (SILENT_DB / 20))))
