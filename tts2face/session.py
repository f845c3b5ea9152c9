"""A talker and a face made ready for each other, and what serves many requests: voices, pictures, gestures."""

from collections import OrderedDict
from collections.abc import Hashable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from lexicon.dictionary import read_dictionary
from tts2face.exemplar.appearance_trajectory import Looks, looks_of
from tts2face.exemplar.synthesis import VisualVoice, visual_voice
from tts2face.face.gesture_transfer import GestureFace, gesture_face
from tts2face.gesture.gesture_stream import Fields
from tts2face.models.face import Face
from tts2face.models.palette import load_palette
from tts2face.models.talker import Talker
from tts2face.own_face.gestures import OwnGestures, own_gestures
from tts2face.render.draw import AnyStage, staged
from tts2face.render.own_face import plate_staged
from tts2face.render.picture import Picture
from tts2face.request import Request
from tts2face.retargeting.to_face import Retargeter, retargeter
from tts2face.synthesis.gesture_layer import Living
from tts2face.voice.engine import Voice, load_voice

VOICES_KEPT = 2  # kinds of voice; each keeps some 100 MB
STAGES_KEPT = 2  # kinds of picture; each keeps some 30 MB
PALETTES_KEPT = 2  # each keeps some 60 MB


@dataclass(frozen=True, slots=True)
class Cast:
    """A talker and a face made ready for each other; serves any number of requests.

    With ``face`` None the talker shows her own face: there is nothing to retarget to, and her ``looks`` are spoken too.
    ``stages`` keeps what was made ready to draw a face into the last few kinds of picture; ``voices`` the voices that
    wait to speak again, by name, language and the user's own words; ``lives`` the palettes that the face is ready for.
    """

    talker: Talker
    face: Face | None
    visual_voice: VisualVoice
    retargeter: Retargeter | None
    looks: Looks | None = None
    stages: "OrderedDict[Hashable, AnyStage]" = field(default_factory=OrderedDict)
    voices: "OrderedDict[Hashable, Voice]" = field(default_factory=OrderedDict)
    lives: "OrderedDict[Hashable, Living]" = field(default_factory=OrderedDict)

    def living(self, request: Request) -> Living | None:
        """The face with the gestures that a request is made with; None where it has none.

        Raises
        ------
        InputError, DataError
            There is no such palette, or it is damaged; or the face cannot show gestures.
        """
        if not request.gestures:
            return None
        key = (request.palette, request.pitch)
        if key not in self.lives:
            palette = load_palette(request.palette)
            face = own_gestures(self.talker, palette) if self.face is None else gesture_face(self.face, palette)
            self.lives[key] = Living(Fields(palette, with_pitch=request.pitch), face)
            while len(self.lives) > PALETTES_KEPT:
                self.lives.popitem(last=False)
        return self.lives[key]

    def shown(self, request: Request) -> Face | None:
        """The face in whose shapes a request's clip moves; None where the talker shows her own."""
        living = self.living(request)
        return living.face.face if living is not None and isinstance(living.face, GestureFace) else self.face

    def stage(self, picture: Picture, request: Request) -> AnyStage:
        """The face made ready to be drawn into a kind of picture; its soft shadows take most of a second."""
        living = self.living(request)
        key = (picture, None if living is None else request.palette)
        if key not in self.stages:
            while len(self.stages) >= STAGES_KEPT:
                self.stages.popitem(last=False)
            face, own = self.shown(request), None if living is None else living.face
            if face is not None:
                self.stages[key] = staged(face, picture)
            else:
                gestures = own if isinstance(own, OwnGestures) else None
                self.stages[key] = plate_staged(self.talker, picture, gestures=gestures)
        return self.stages[key]

    @contextmanager
    def voice(self, request: Request) -> Iterator[Voice]:
        """A voice for the time of a request, used by nobody else; loading one takes half a second."""
        own = read_dictionary(request.dictionary).entries if request.dictionary else {}
        key = (request.voice, request.language, frozenset(own.items()))
        voice = self.voices.pop(key, None) or load_voice(request.voice, request.language, own)
        try:
            yield voice
        finally:
            self.voices[key] = voice
            while len(self.voices) > VOICES_KEPT:
                self.voices.popitem(last=False)


def cast(talker: Talker, face: Face | None) -> Cast:
    """Index the talker's exemplars and prepare the way of their motion onto the face, or onto her own without one.

    Raises
    ------
    InputError
        There is no face, and the talker has motion only.
    """
    voice = visual_voice(talker)
    if face is None:
        return Cast(talker, None, voice, None, looks_of(talker, voice))
    return Cast(talker, face, voice, retargeter(talker, face))
