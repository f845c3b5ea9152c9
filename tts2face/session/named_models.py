"""Models of a session by name or path."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from lexicon.errors import InputError, Tts2faceError
from lexicon.values.fields import check_fields
from tts2face.models.face_names import default_face
from tts2face.models.person import SHIPPED_PEOPLE, Person, parse_person, person_of
from tts2face.request import OWN_FACE

if TYPE_CHECKING:
    from tts2face.models.face import Face
    from tts2face.session.session import Session
    from tts2face.sound.voice_pool import VoicePool


@dataclass(frozen=True, slots=True)
class Models:
    """Models that show and move a speaker, by name or path.

    Without a face, `tts2face.models.face_names.default_face`; `person` is the sex and age of who is shown
    (`tts2face.models.person.parse_person`), None for what is known of the face.

    Raises
    ------
    InputError
        A name is no text, or the person is unknown.
    """

    talker: str = "grid_s1"
    face: str = ""
    identity: str | None = None
    palette: str | None = "starter"
    hair: str | None = None
    hair_color: str | None = None
    person: str | None = None

    def __post_init__(self) -> None:
        """Reject values of other types, and choose a face where none is named."""
        check_fields(self)
        if self.person is not None:
            parse_person(self.person)
        if not self.face:
            object.__setattr__(self, "face", default_face(self.identity, self.hair))

    def description(self) -> Mapping[str, Any]:
        """Metadata of the face, without reading it as a whole; raises as `Session`."""
        return described_face(self.face, self.identity)

    def shown_person(self) -> Person | None:
        """Person who is shown, None where nothing is known; raises as `Session`."""
        return person_of(self.description()) if self.person is None else parse_person(self.person)

    def shown_face(self) -> "Face | None":
        """Face of these models, None for the talker's own; raises as `Session`."""
        from tts2face.session.shared_models import shown_face

        return shown_face(self.face, self.identity, self.hair, self.hair_color)

    def open_session(self, voices: "VoicePool | None" = None, *, memory_mb: float = 0.0) -> "Session":
        """Session of these models; raises as `Session`."""
        from tts2face.session.session import Session  # a second of imports

        return Session(
            self.talker, self.face, identity=self.identity, palette=self.palette, hair=self.hair,
            hair_color=self.hair_color, person=self.person, voices=voices, memory_mb=memory_mb,
        )  # fmt: skip


def described_face(face: str, identity: str | None) -> Mapping[str, Any]:
    """Metadata of a face by name or path, with its identity; the names alone of a shipped one and of a talker's own."""
    if face == OWN_FACE or (face, None) in SHIPPED_PEOPLE:
        return {"name": face, "identity": identity}
    from tts2face.models.face_file import FORMAT_VERSION, KIND
    from tts2face.storage.shipped import find_file
    from tts2face.storage.tensors import read_metadata

    try:
        stated = read_metadata(find_file(face, KIND), KIND, FORMAT_VERSION).get("metadata")
    except InputError:  # the service's name of an uploaded face; what does not exist is refused where it is loaded
        return {"name": face, "identity": identity}
    except Tts2faceError:
        raise
    except (OSError, ValueError) as refused:  # a name that is too long, or with U+0000
        raise InputError(f"the face {face[:60]!r} cannot be read ({refused}); check its path") from refused
    return {**(stated if isinstance(stated, dict) else {}), "identity": identity}
