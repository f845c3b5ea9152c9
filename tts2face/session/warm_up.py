"""Compilation of all kernels at the first run on a machine; later runs load them from the disk cache.

numba compiles one kernel at a time in each process. So a command compiles the kernels of motion, of gestures, of sound
and of strands in a child process for each further core, beside the other drawing kernels, and itself what is left after
these; a server divides them among its synthesis processes.
"""

import threading
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np

from lexicon.errors import BackendError
from lexicon.sequence import SILENCE, PhoneSequence
from tts2face.gestures import field_kernels
from tts2face.lips import contacts
from tts2face.models.face import Face, keep_parts
from tts2face.models.face_loading import load_face
from tts2face.models.light import Lamps
from tts2face.models.talker_file import load_talker
from tts2face.picture.options import Picture
from tts2face.processes.child import Call, Handler
from tts2face.processes.parent import Child
from tts2face.processes.program import Program
from tts2face.processes.threads import available_cores
from tts2face.session.named_models import Models
from tts2face.sound import segments

# seconds of one kernel in a child
COMPILE_TIMEOUT_S = 120.0
Kernel = tuple[ModuleType, str]
MOTION: Kernel = (contacts, "_closest_rows")  # one of the last that `compile_motion` compiles, and nothing else needs
GESTURES: Kernel = (field_kernels, "generate_frames")
SOUND: Kernel = (segments, "_search")


def kernels_are_compiled(drawn: Face | None) -> bool:
    """Whether the kernels of motion, and those that draw a face, are in the disk cache.

    Compiling them delays the first result by some seconds.
    """
    return _is_compiled(*MOTION) and (drawn is None or _is_compiled(*_drawing_kernel(drawn)))


def _drawing_kernel(drawn: Face) -> "Kernel":
    from tts2face.picture.baked import visibility
    from tts2face.picture.kernels import raster

    return (raster, "draw_band") if isinstance(drawn.light, Lamps) else (visibility, "find_nearest")


def _is_compiled(module: ModuleType, name: str) -> bool:
    return bool(getattr(module, name).files())


def compile_kernels(drawn: Face | None) -> None:
    """Compile all kernels that a clip of a face needs; None for a clip without pictures.

    This process compiles those of pictures, and then, in turn with a child for each further core, the others. If a
    child fails, its kernels are compiled at their first use.
    """
    from tts2face.picture.materials import STRANDS

    has_strands = drawn is not None and isinstance(drawn.light, Lamps)
    names = deque(name for name, work in TASKS.items() if has_strands or work is not compile_strands)
    children = [Child(Program(f"{__name__}:HANDLERS")) for _ in range(min(available_cores() - 1, len(names)))]
    threads = [threading.Thread(target=_compile, args=(child, names), daemon=True) for child in children]
    for thread in threads:
        thread.start()
    try:
        if drawn is not None:
            compile_pictures(keep_parts(drawn, lambda part: part.kind != STRANDS) if has_strands else drawn)
        # an empty list is the end: there is no lock between test and take
        with suppress(IndexError):  # the children have taken the rest
            while True:
                TASKS[names.popleft()]()
        for thread in threads:
            thread.join()
    finally:
        names.clear()
        for child in children:
            child.close()


def _compile(child: Child, names: deque[str]) -> None:
    with suppress(BackendError, IndexError):  # its kernels are compiled at their first use; no work is left
        while True:
            child.call(names.popleft(), {}, timeout_s=COMPILE_TIMEOUT_S)


def compile_pictures(face: Face) -> None:
    """Compile the kernels that draw a face, those of its strands included, by one small picture."""
    from tts2face.face.deformation import REST_HEAD
    from tts2face.picture.renderer import draw

    head = np.full(len(REST_HEAD), 0.01, np.float32)
    draw(face, np.zeros(len(face.shape_names), np.float32), head, picture=Picture(size="64x64"))


def compile_strands() -> None:
    """Compile the kernels of hair, lashes and brows, a quarter of the drawing kernels' time, without the others."""
    from tts2face.picture.camera import camera_matrices
    from tts2face.picture.kernels.lamps import FIRST_LIGHT_ROW, LAMPS
    from tts2face.picture.kernels.picture import allocate_buffers, arrange_cards, blend_strands
    from tts2face.picture.kernels.strand_light import light_strands
    from tts2face.picture.surface import build_surface

    face, picture = load_face("head"), Picture(size="16x16")
    surface, optics = build_surface(face), camera_matrices(picture.view, face, (16, 16))
    buffers, cards = allocate_buffers(surface, (16, 16), picture.samples_per_side), surface.strands
    lights = np.zeros((FIRST_LIGHT_ROW + len(LAMPS), 6), np.float32)
    exposure, turn = np.zeros((len(face.vertices), 1 + len(LAMPS)), np.float32), np.eye(3, dtype=np.float32)
    light = (exposure, lights, optics.lens)
    light_strands(cards.vertices, cards.outward @ turn, cards.tangents @ turn, light, buffers.vertex, buffers.strands)
    blend_strands(surface, arrange_cards(cards, buffers.strands), 0, lights, buffers)


def compile_motion() -> None:
    """Compile the kernels of lip synthesis and retargeting by synthesising one second of motion."""
    from tts2face.lips.exemplar import build_exemplar_model, speech_trajectory
    from tts2face.lips.retargeting import build_retargeter

    talker = load_talker("grid_s1")
    retargeter = build_retargeter(talker, load_face("head"))
    phones = PhoneSequence([SILENCE, "p", "f", "ɑ", SILENCE], [0.0, 0.3, 0.4, 0.5, 0.7, 1.0])
    retargeter.retarget(speech_trajectory(phones, build_exemplar_model(talker), fps=30.0, n_frames=30))


def compile_gestures() -> None:
    """Compile the kernels of gestures by three frames of them."""
    from tts2face.gestures.stream import GestureFields, GestureStream
    from tts2face.gestures.timeline import Timeline
    from tts2face.models.palette_file import load_palette
    from tts2face.types import Waveform

    gestures = GestureStream(GestureFields(load_palette("starter")), style="grid_s1", seed=0, fps=30.0)
    gestures.next(Waveform(np.zeros(1600), 16_000), 3, Timeline())


def compile_sound() -> None:
    """Compile the kernels of the level of sound and of edges."""
    from tts2face.models.phone_classifier import load_phone_classifier
    from tts2face.sound.loudness import block_powers
    from tts2face.sound.segments import StatedPhone, find_edges
    from tts2face.types import Waveform

    sound = Waveform(np.zeros(1600), 16_000)
    block_powers(sound)
    stated = [StatedPhone(SILENCE, 0.0), StatedPhone("ə", 0.03, 0.03), StatedPhone(SILENCE, 0.06)]
    find_edges(sound, stated, load_phone_classifier("heart"))


def _motion() -> None:
    if not _is_compiled(*MOTION):
        compile_motion()


def _gestures() -> None:
    if not _is_compiled(*GESTURES):
        compile_gestures()


def _sound() -> None:
    if not _is_compiled(*SOUND):
        compile_sound()


def _pictures(call: Call) -> dict[str, Any]:
    """The kernels that draw the face of the fields of `Models`."""
    face = Models(**call.content).shown_face()
    if face is not None and not _is_compiled(*_drawing_kernel(face)):
        compile_pictures(face)
    return {}


def _handler(work: Callable[[], None]) -> Handler:
    def handle(_: Call) -> dict[str, Any]:
        work()
        return {}

    return handle


TASKS: Mapping[str, Callable[[], None]] = MappingProxyType({
    "compile_motion": _motion, "compile_strands": compile_strands, "compile_gestures": _gestures,
    "compile_sound": _sound,
})  # fmt: skip
HANDLERS: Mapping[str, Handler] = MappingProxyType(
    {name: _handler(work) for name, work in TASKS.items()} | {"compile_pictures": _pictures}
)
