"""Short videos in a page: the recording beside the default head with the synthesised motion."""

from base64 import b64encode
from collections.abc import Iterator, Sequence
from fractions import Fraction
from functools import cached_property
from io import BytesIO
from typing import Any

import numpy as np
from numpy.typing import NDArray

from corpus_tools.measures.reference import ReferenceUtterance
from corpus_tools.studies.evaluation.evaluate import SplitResult
from corpus_tools.studies.pages import note_paragraph
from lexicon.errors import DataError, InputError
from tts2face.lips.retargeting import build_retargeter
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.talker import speech_channels
from tts2face.picture.options import Picture
from tts2face.picture.renderer import MeshRenderer, mesh_renderer
from tts2face.types import Trajectory
from tts2face.video.media import read_frames

SIDE_PX = 240
SETTINGS = {"crf": "26", "preset": "veryfast"}  # about 100 kB per sentence
NOTE = "Left: the recording; right: {method} on the default head. No sound."


class MethodVideos:
    """Videos of the motion synthesised by one method; the head is loaded on first use."""

    def __init__(self, method: str) -> None:
        """Videos of the motion synthesised by `method`."""
        self._method = method

    @cached_property
    def _face(self) -> Face:
        return load_face("head")

    @cached_property
    def _renderer(self) -> MeshRenderer:
        return mesh_renderer(self._face, Picture(size=f"{SIDE_PX}x{SIDE_PX}", camera="close"))

    def render_tag(self, run: SplitResult, at: int) -> str:
        """Video of one utterance (HTML); empty if the recording is missing or too short."""
        recording = run.real[at]
        observation = list(evaluated_pictures(recording))
        if len(observation) < recording.evaluated.stop - recording.evaluated.start:
            return ""
        speech = Trajectory(speech_channels(run.model), run.synthesised[self._method][at], recording.observation.fps)
        weights = build_retargeter(run.talker, self._face).retarget(speech).values
        sides = [
            np.concatenate([letterbox(pixels), self._renderer.draw(row)], axis=1)
            for pixels, row in zip(observation, weights[recording.evaluated], strict=False)
        ]
        return video_tag(sides, recording.observation.fps, NOTE.format(method=self._method))


def evaluated_pictures(utterance: ReferenceUtterance) -> Iterator[NDArray[np.uint8]]:
    """The pictures of an utterance's evaluated frames; fewer if the video cannot be read."""
    observation = utterance.observation
    instants = (
        observation.quality.cut
        + (np.arange(utterance.evaluated.start, utterance.evaluated.stop) - 0.5) / observation.fps
    )
    at = 0
    try:
        for picture in read_frames(observation.video):
            while at < len(instants) and picture.time >= instants[at]:
                yield picture.pixels
                at += 1
            if at == len(instants):
                return
    except (DataError, InputError):
        return  # the video was removed after the evaluation; the page shows its curves only


def letterbox(pixels: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """An (H, W, 3) picture scaled to fit a black square of `SIDE_PX`."""
    from PIL import Image

    shown = Image.fromarray(pixels)
    shown.thumbnail((SIDE_PX, SIDE_PX))
    square = Image.new("RGB", (SIDE_PX, SIDE_PX))
    square.paste(shown, ((SIDE_PX - shown.width) // 2, (SIDE_PX - shown.height) // 2))
    return np.asarray(square)


def video_tag(pictures: Sequence[NDArray[np.uint8]], fps: float, text: str) -> str:
    """A silent looping video embedded in the page, with a note below it."""
    import av

    height, width = pictures[0].shape[:2]
    content = BytesIO()
    with av.open(content, "w", format="mp4") as container:
        stream: Any = container.add_stream("libx264", rate=Fraction(fps).limit_denominator(1001), options=SETTINGS)
        stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
        for pixels in pictures:
            container.mux(stream.encode(av.VideoFrame.from_ndarray(pixels, format="rgb24")))
        container.mux(stream.encode())
    data = b64encode(content.getvalue()).decode()
    return (
        f'<video autoplay loop muted playsinline controls width="{width}" height="{height}" '
        f'src="data:video/mp4;base64,{data}"></video>\n{note_paragraph(text)}'
    )
