"""``tts2face mimic --camera``: a person before a camera moves a head in a window."""

from pathlib import Path
from typing import TYPE_CHECKING

from cli.progress import write_message

if TYPE_CHECKING:
    from tts2face.render.picture import Picture


def run_live_window(source: str, face: str, identity: str | None, picture: "Picture", model: Path | None) -> None:
    """Show a head that does what the person before the camera does, until the window is closed."""
    from tts2face.models.face_file import load_face
    from tts2face.render.window import LiveWindow, require_display
    from tts2face.synthesis.live_capture import CALIBRATION_S, LiveCapture
    from tts2face.video.camera import CaptureDevice

    require_display("--camera")
    shown = load_face(face, identity)
    with CaptureDevice(source) as camera:
        write_message(
            f"look into the camera for {CALIBRATION_S:.0f} s: close your lips, speak, blink; then the head follows you"
        )
        with LiveCapture(camera.pictures(), shown, camera.fps, model) as actor:
            window = LiveWindow(shown, picture, actor.latest_pose)
            try:
                window.run()
            finally:
                window.close()
