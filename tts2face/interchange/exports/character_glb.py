"""Animation of an imported face as the character's own .glb file."""

from lexicon.errors import InputError
from tts2face.interchange.characters.animation import animate_character
from tts2face.interchange.characters.binding import character_file, has_binding, read_binding
from tts2face.interchange.exports.face_glb import FaceGlbWriter
from tts2face.interchange.exports.parts import FormatWriter, Part, Target
from tts2face.interchange.exports.spooled_frames import SpooledFrames
from tts2face.storage.output_paths import refuse_overwriting


class CharacterGlbWriter:
    """Keeps frames in temporary files, and writes the character's file when their number is known."""

    def __init__(self, target: Target) -> None:
        if target.face is None:
            raise InputError(f"{target.name} holds the character of the face; give the face, as in face=session.face")
        source = character_file(read_binding(target.face))  # a missing file is reported with the first clip
        refuse_overwriting({"the export": target.path.with_name(target.name)}, {"the character": source})
        self._target, self._face = target, target.face
        self._frames = SpooledFrames(target.channels)

    def add(self, part: Part) -> None:
        """Append frames."""
        self._frames.add(part)

    def finish(self) -> None:
        """Write the file."""
        motion, head = self._frames.trajectories(float(self._target.fps))
        animated = animate_character(motion, head, self._face, self._target.mark, end_s=self._frames.end_s)
        self._target.path.write_bytes(animated.content)

    def close(self) -> None:
        """Remove the temporary files."""
        self._frames.close()


def make_glb_writer(target: Target) -> FormatWriter:
    """Writer of the character's own file for a face that was imported from one, otherwise of the face's mesh."""
    is_imported = target.face is not None and has_binding(target.face)
    return CharacterGlbWriter(target) if is_imported else FaceGlbWriter(target)
