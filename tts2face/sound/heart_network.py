"""The network of the voice ``heart`` in two parts, between which the durations of its letters are decided.

Letters -> hidden states and durations; letters, hidden states and durations -> spectra and F0 of frames. Both are
optimised once and kept on disk.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from tts2face.numeric.arrays import FloatArray
from tts2face.sound.onnx_part import FLOAT, INT64, cut_model
from tts2face.sound.voice import NativeRun
from tts2face.storage.array_cache import computed_once

DURATION_STEP_S = 0.025  # length of one step of the durations
FRAMES_PER_STEP = 2
FRAME_S = DURATION_STEP_S / FRAMES_PER_STEP
CACHE_KIND, CACHE_VERSION = "voices", 2  # raised when the parts of the same model change
# tensors of the graph: states of the letters, their durations in steps before they are rounded, and after
HIDDEN = "/Transpose_55_output_0"
DURATIONS = "/Sub_output_0"
STEPS = "/Cast_32_output_0"
N_STATES = 192
SPECTRA = ("lh", "theta", "ln", "lr", "phi", "f0")
LETTERS = "ids"
READER = {LETTERS: (INT64, (1, "L"))}
SPEAKER = {**READER, HIDDEN: (FLOAT, (1, N_STATES, "L")), STEPS: (INT64, ("L",))}


class Frames(NamedTuple):
    """Output of the network for T frames of `FRAME_S`, in 601 bins of 20 Hz.

    Parameters
    ----------
    harmonic, harmonic_phase : (601, T)
        Log magnitude of the harmonics of F0 and, as arcus tangens, their phase over pi.
    noise : (601, T)
        Log magnitude of noise.
    free, free_phase : (601, T)
        Log magnitude and phase of what is neither.
    f0 : (T,)
        In Hz; below 40 where there is no voice.
    """

    harmonic: NDArray[np.float32]
    harmonic_phase: NDArray[np.float32]
    noise: NDArray[np.float32]
    free: NDArray[np.float32]
    free_phase: NDArray[np.float32]
    f0: NDArray[np.float32]


class HeartNetwork:
    """Two ONNX sessions, whose runs can be ended."""

    def __init__(self, model: bytes, run: NativeRun | None = None) -> None:
        self._reader, self._speaker = open_network(model)
        self._run = run or _run_within

    def read(self, letters: Sequence[int]) -> tuple[NDArray[np.float32], FloatArray]:
        """Hidden states of L letters, and their durations (L,) in steps of `DURATION_STEP_S`, with fractions."""
        hidden, durations = self._call(self._reader, {LETTERS: np.asarray([letters], np.int64)})
        return hidden, np.ravel(durations).astype(np.float64)

    def frames(self, letters: Sequence[int], hidden: NDArray[np.float32], steps: NDArray[np.int64]) -> Frames:
        """Frames of L letters with durations (L,) in whole steps."""
        inputs = {LETTERS: np.asarray([letters], np.int64), HIDDEN: hidden, STEPS: steps}
        return Frames(*(output[0] for output in self._call(self._speaker, inputs)))

    def _call(self, session: Any, inputs: Any) -> Any:
        import onnxruntime

        options = onnxruntime.RunOptions()
        options.log_severity_level = 4  # fatal errors; an end is none

        def end() -> None:
            options.terminate = True

        return self._run(lambda: session.run(None, inputs, options), end)


def _run_within(run: Callable[[], Any], _: Callable[[], None]) -> Any:
    return run()


def open_network(model: bytes) -> tuple[Any, Any]:
    """ONNX sessions of both parts, which free their memory after each sentence; an arena would retain up to 100 MB.

    Optimising a graph takes most of the time of a session. It is kept as far as it is the same on every machine; what
    depends on the processor is done each time.
    """
    import onnxruntime

    kept = computed_once(
        CACHE_KIND, CACHE_VERSION, [np.frombuffer(model, np.uint8), HIDDEN, DURATIONS, onnxruntime.__version__],
        lambda: {
            "reader": _optimised(cut_model(model, READER, (HIDDEN, DURATIONS))),
            "speaker": _optimised(cut_model(model, SPEAKER, SPECTRA)),
        },
        lambda found: all(name in found and found[name].dtype == np.uint8 for name in ("reader", "speaker")),
    )  # fmt: skip
    return _opened(kept["reader"]), _opened(kept["speaker"])


def _opened(graph: NDArray[Any]) -> Any:
    import onnxruntime

    session = _session(graph.tobytes(), onnxruntime.GraphOptimizationLevel.ORT_ENABLE_ALL)
    session._model_bytes = None  # kept for a start on another provider: the size of the model, for as long as it lasts
    return session


def _optimised(model: bytes) -> NDArray[np.uint8]:
    """Bytes (N,) of a model, optimised for any machine."""
    import onnxruntime

    # the layouts of ORT_ENABLE_ALL are those of one processor (decision 160)
    level = onnxruntime.GraphOptimizationLevel.ORT_ENABLE_EXTENDED
    with TemporaryDirectory(prefix="tts2face-") as folder:
        path = Path(folder, "graph.onnx")
        _session(model, level, path)
        return np.frombuffer(path.read_bytes(), np.uint8)


def _session(model: bytes, level: Any, written: Path | None = None) -> Any:
    """Session that optimises up to a level, and writes its graph to a path if there is one."""
    import onnxruntime

    options = onnxruntime.SessionOptions()
    # one thread: convolutions give other bits at other numbers of threads
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3  # errors
    # an arena keeps up to 100 MB after a sentence (decision 073)
    options.enable_cpu_mem_arena = options.enable_mem_pattern = False
    options.graph_optimization_level = level
    if written is not None:
        options.optimized_model_filepath = str(written)
    return onnxruntime.InferenceSession(model, options, providers=["CPUExecutionProvider"])
