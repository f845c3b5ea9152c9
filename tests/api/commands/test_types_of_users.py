"""Types of the package, as a user's type checker sees them."""

import subprocess
import sys
from pathlib import Path

import tts2face


def test_a_script_that_uses_the_package_passes_mypy_strict(tmp_path: Path) -> None:
    script = tmp_path / "script.py"
    script.write_text(
        "import tts2face\n"
        "session = tts2face.Session(talker='grid_s1', face='head')\n"
        "clip: tts2face.Clip = session.clip('Hello there.', style='delighted')\n"
        "rate: int = clip.speech.waveform.rate\n"
        "names: tuple[str, ...] = clip.motion.channels\n"
        "for piece in session.stream('A long text.', fps=25):\n"
        "    part: tts2face.Clip = piece.clip\n"
        "tts2face.write_clip(clip, session.face, 'again.mp4')\n"
        "styles: list[str] = [style.name for style in tts2face.styles()]\n"
    )
    answer = subprocess.run(
        [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), str(script)],
        capture_output=True, text=True, check=False, cwd=Path(tts2face.__file__).parents[1],
    )  # fmt: skip
    assert answer.returncode == 0, answer.stdout
