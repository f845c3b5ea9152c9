"""Writing of a recorded performance to its outputs."""

from collections.abc import Callable

from tts2face.render.picture import Picture
from tts2face.synthesis.output_files import OutputFiles
from tts2face.synthesis.performance import Performance, perform, take_clips
from tts2face.synthesis.session_models import SessionModels
from tts2face.synthesis.written_clip import WrittenClip
from tts2face.types import Progress


def write_take(
    performance: Performance,
    models: SessionModels,
    to: tuple[OutputFiles, Picture],
    stages: Callable[[str], Progress] | None,
) -> WrittenClip:
    """Transfer a performance to the face of a session and write it; as `Session.write_performance`."""
    outputs, picture = to
    face = models.speech_face
    outputs.check_face(face)  # before the video is tracked, as are the drawing options
    renderer = None if outputs.out is None else models.renderer(picture, has_gestures=False)
    take = perform(performance, face, on_progress=stages("tracking") if stages else None)
    if renderer is not None and take.face is not face:  # motion was appended to the face
        renderer = take.face.renderer(picture)
    n_frames = len(take.motion.face)
    draw = stages("writing" if renderer is None else "drawing") if stages else None
    on_frames = (lambda done, _: draw(done, n_frames)) if draw else None
    with outputs.open(take.face, renderer, on_frames) as files:
        for clip in take_clips(take.motion, take.sound):
            files.add(clip)
    is_silent = not len(take.sound.samples)
    return WrittenClip(outputs.path, take.seconds, n_frames, is_silent=is_silent, exports=outputs.export_paths)
