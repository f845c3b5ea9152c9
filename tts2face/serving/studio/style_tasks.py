"""Tasks of the pages of styles and of puppetry: moving swatches of styles, and takes as curves with their sound."""

import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

import numpy as np

from tts2face.models.palette_editing import StyleMix, mix_styles
from tts2face.picture.options import Picture
from tts2face.serving.service.messages import Event, Inputs, Task, Work
from tts2face.storage.wave_files import pcm_bytes
from tts2face.types import Chunk

if TYPE_CHECKING:
    from tts2face.session.session import Session


SPOKEN = "Hello there, nice to see you."
N_TILES = 20  # of a swatch
TILE_PX = 144  # of a side
EVERY = 3  # frames of the clip from one tile to the next
MIXED = "mixed here"  # name of a style that no palette holds yet
QUALITY = 70  # of the WebP


def swatch(session: "Session", work: Work, _: Inputs) -> Iterator[Chunk]:
    """A picture (WebP) of `N_TILES` instants of a style, one beside the other: ``style``, or a ``mix`` of others."""
    from PIL import Image

    name = work.request.get("style", MIXED)
    if "mix" in work.request:
        palette = session.palette
        assert palette is not None
        session = session.with_style(name, mix_styles(palette, StyleMix(**work.request["mix"])))
    # the quickest voice: nobody hears it
    clip = session.clip(SPOKEN, style=name, voice="espeak", plain_delivery=True)
    yield Chunk(b"")
    renderer = session.renderer(Picture(size=f"{TILE_PX}x{TILE_PX}", camera="close"))
    sheet = Image.new("RGB", (N_TILES * TILE_PX, TILE_PX))
    for tile in range(N_TILES):
        frame = min(EVERY * tile, len(clip.motion) - 1)
        sheet.paste(Image.fromarray(renderer.frame(clip, frame)), (tile * TILE_PX, 0))
        yield Chunk(b"")
    content = io.BytesIO()
    sheet.save(content, "WEBP", quality=QUALITY, xmp=renderer.mark.packet.encode())
    yield Chunk(content.getvalue())


def take(session: "Session", work: Work, _: Inputs) -> Iterator[Event | Chunk]:
    """A Live Link table (``take``) and its sound (``sound``, a path or null) on the face: an event, then its arrays.

    The arrays are motion and head pose as 32-bit floats, and samples as 16-bit numbers.
    """
    from tts2face.session.performance import Performance, perform

    sound = work.request.get("sound")
    performance = Performance(take=Path(work.request["take"]), audio=None if sound is None else Path(sound))
    done = perform(performance, session.animated_face(has_gestures=False))
    motion, head = done.motion.face, done.motion.head
    sound_bytes = pcm_bytes(np.clip(done.sound.samples, -1.0, 1.0))
    described: dict[str, Any] = {
        "type": "take", "fps": motion.fps, "channels": list(motion.channels), "n_frames": len(motion),
        "rate": done.sound.rate, "n_samples": len(done.sound.samples), "seconds": done.seconds,
    }  # fmt: skip
    yield Event(described)
    yield Chunk(motion.values.astype("<f4").tobytes() + head.values.astype("<f4").tobytes() + sound_bytes)


TASKS: Mapping[str, Task] = MappingProxyType({"swatch": swatch, "take": take})
