"""Models of a session by name or path."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from lexicon.values.fields import check_fields
from tts2face.models.face_names import default_face

if TYPE_CHECKING:
    from tts2face.models.face import Face
    from tts2face.session.session import Session
    from tts2face.sound.voice_pool import VoicePool


@dataclass(frozen=True, slots=True)
class Models:
    """Models that show and move a speaker, by name or path.

    Without a face, `tts2face.models.face_names.default_face`.

    Raises
    ------
    InputError
        A name is no text.
    """

    talker: str = "grid_s1"
    face: str = ""
    identity: str | None = None
    palette: str | None = "starter"
    hair: str | None = None
    hair_color: str | None = None

    def __post_init__(self) -> None:
        """Reject values of other types, and choose a face where none is named."""
        check_fields(self)
        if not self.face:
            object.__setattr__(self, "face", default_face(self.identity, self.hair))

    def shown_face(self) -> "Face | None":
        """Face of these models, None for the talker's own; raises as `Session`."""
        from tts2face.session.shared_models import shown_face

        return shown_face(self.face, self.identity, self.hair, self.hair_color)

    def open_session(self, voices: "VoicePool | None" = None, *, memory_mb: float = 0.0) -> "Session":
        """Session of these models; raises as `Session`."""
        from tts2face.session.session import Session  # a second of imports

        return Session(
            self.talker, self.face, identity=self.identity, palette=self.palette, hair=self.hair,
            hair_color=self.hair_color, voices=voices, memory_mb=memory_mb,
        )  # fmt: skip
