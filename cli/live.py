"""``tts2face mimic --camera``: a person before a camera moves a head in a window."""

from pathlib import Path
from typing import TYPE_CHECKING

from cli.progress import say

if TYPE_CHECKING:
    from tts2face.render.picture import Picture


def live(source: str, face: str, identity: str | None, picture: "Picture", model: Path | None) -> None:
    """Show a head that does what the person before the camera does, until the window is closed."""
    from tts2face.models.face_file import load_face
    from tts2face.render.window import Mirror, require_display
    from tts2face.synthesis.live_capture import LEARNING_S, Actor
    from tts2face.video.camera import Camera

    require_display("--camera")
    shown = load_face(face, identity)
    with Camera(source) as camera:
        say(f"look into the camera for {LEARNING_S:.0f} s: close your lips, speak, blink; then the head follows you")
        with Actor(camera.pictures(), shown, camera.fps, model) as actor:
            window = Mirror(shown, picture, actor.newest)
            try:
                window.run()
            finally:
                window.close()
