"""Models that the requests of a session share, each loaded or computed at its first use."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeVar

from lexicon.errors import InputError
from tts2face.gestures.stream import FIELD_OPTIONS, GestureFields
from tts2face.lips.exemplar import ExemplarModel, build_exemplar_model, exclude_tokens
from tts2face.lips.options import ExcludedToken
from tts2face.models.face import Face
from tts2face.models.face_loading import load_face
from tts2face.models.face_names import default_face
from tts2face.models.palette import Derivation, Palette
from tts2face.models.palette_editing import add_derivation
from tts2face.models.palette_file import load_palette
from tts2face.models.person import Person, person_of, seed_of
from tts2face.models.talker import Talker
from tts2face.models.talker_file import load_talker
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import Picture
from tts2face.request import OWN_FACE, Request
from tts2face.session.animated_face import AnimatedFace, mesh_face, own_appearance_face
from tts2face.session.gesture_layer import METHODS, GestureLayer, GestureMethod
from tts2face.session.lip_steps import SynthesisModels
from tts2face.session.marked_styles import check_own_styles, marked_styles, with_styles_of
from tts2face.session.phrase_delivery import NO_DELIVERIES
from tts2face.session.prepared import PreparedRequest
from tts2face.session.speech_stream import Piece, SpeechModels
from tts2face.session.steps import pieces
from tts2face.sound.fitting import fitted_voices
from tts2face.sound.voice_pool import VoicePool
from tts2face.storage.marks import Making
from tts2face.storage.memory import NO_MEMORY, ResultMemory
from tts2face.storage.signing import Signer
from tts2face.types import Progress, ignore_progress

MAX_RENDERERS = 2  # renderers in memory, one for each picture; about 30 MB each

Value = TypeVar("Value")


def shown_face(
    face: str | Path | Face | None, identity: str | None, hair: str | None, hair_color: str | None
) -> Face | None:
    """Face that a session shows; None for the talker's own face.

    Raises
    ------
    InputError
        There is no such face, identity, haircut or colour, or they exclude each other.
    DataError
        A file is damaged.
    """
    has_hair = hair is not None or hair_color is not None
    if isinstance(face, Face):
        if has_hair or identity is not None:
            raise InputError("identity and hair belong to a face given by name; remove them, or load it with them")
        return face
    if face != OWN_FACE:
        name = str(face) if face else default_face(identity, hair)
        return load_face(name, identity, hair=hair, hair_color=hair_color)
    if identity is not None:
        raise InputError("a talker's own face has no identity presets; remove the identity, or choose another face")
    if has_hair:
        raise InputError("a talker's own face has the hair of its video; remove --hair and --hair-color")
    return None


def photographed_face(
    photo: str | Path, consent: str | None, smile: str | Path | None, others: tuple[object, ...]
) -> Face:
    """Face of a photo, beside which there are no other choices of a face."""
    from tts2face.photo.face_from_photo import face_from_photo

    if any(other is not None for other in others):
        raise InputError("a photo has its own face and hair; remove face, identity and hair, or the photo")
    return face_from_photo(photo, consent=consent, smile=smile)


class SessionModels:
    """Talker, faces, palette, exemplars, gesture fields, renderers and voices of a session.

    All methods are thread-safe: each model is made by one thread, once, and is read-only.

    Parameters
    ----------
    talker, palette, voices
        As for `tts2face.Session`.
    mesh
        Face to show; None for the talker's own face.
    memory
        Speech and lip motion of finished sentences.
    person
        Who is shown, whose voice speaks where none is named; None: whom the face names. ``seed`` is that of the face.
    """

    def __init__(
        self,
        talker: str | Path | Talker,
        mesh: Face | None,
        palette: str | Path | Palette | None,
        voices: VoicePool | None = None,
        memory: ResultMemory = NO_MEMORY,
        *,
        person: Person | None = None,
    ) -> None:
        self.talker: Talker = talker if isinstance(talker, Talker) else load_talker(str(talker))
        self._mesh, self._memory = mesh, memory
        self._palette = palette
        self._lock = threading.RLock()
        self._cache: dict[Hashable, Any] = {}
        self._renderers: OrderedDict[Hashable, FrameRenderer] = OrderedDict()
        self.voices = voices or VoicePool()
        shown = {**self.talker.metadata, "name": OWN_FACE} if mesh is None else mesh.metadata
        self.signer: Signer | None = None  # of the files of all requests
        self.person, self.seed = person or person_of(shown), seed_of(shown)
        self.idle_motions: OrderedDict[str, Any] = OrderedDict()  # of `tts2face.session.live.idle`, by their options
        self._without: tuple[tuple[ExcludedToken, ...], ExemplarModel] | None = None
        self.speech_face: AnimatedFace = (
            own_appearance_face(self.talker, self._exemplars)
            if mesh is None
            else mesh_face(self.talker, self._exemplars, mesh)
        )

    @property
    def palette(self) -> Palette | None:
        """Palette with the styles of the gestures; None without gestures."""
        given = self._palette
        if given is None or isinstance(given, Palette):
            return given
        return self._once("palette", lambda: load_palette(str(given)))

    @property
    def n_fixed_channels(self) -> int:
        """Number of first channels that have no rest: those of a talker's own video, 0 for a mesh."""
        return len(self.speech_face.channels) if self._mesh is None else 0

    def face(self, *, has_gestures: bool = True) -> AnimatedFace:
        """Face with the channels of speech, and with those of the palette's gestures if there is a palette."""
        palette = self.palette if has_gestures else None
        if palette is None:
            return self.speech_face
        return self._once("face", lambda: self.speech_face.with_gestures_of(palette))

    def with_style(self, name: str, derived: Derivation) -> "SessionModels":
        """Models with one more derived style, which share everything else; errors as `Session.with_style`."""
        palette = self.palette
        if palette is None:
            raise InputError("a session without a palette has no styles; open it with one")
        new = copy(self)
        more = add_derivation(palette, name, derived)
        new._palette, new._memory = more, NO_MEMORY  # finished sentences are kept by the names of styles
        with self._lock:
            new._cache = {
                key: replace(value, palette=more) if isinstance(value, GestureFields) else value
                for key, value in self._cache.items()
            }
        return new

    def renderer(self, picture: Picture, *, has_gestures: bool) -> FrameRenderer:
        """Renderer of the face for drawing options; the last `MAX_RENDERERS` renderers are cached."""
        face, key = self.face(has_gestures=has_gestures), (picture, has_gestures)
        with self._lock:
            if key not in self._renderers:
                while len(self._renderers) >= MAX_RENDERERS:
                    self._renderers.popitem(last=False)
                self._renderers[key] = face.renderer(picture)
            return self._renderers[key]

    def with_own_styles(self, prepared: PreparedRequest) -> PreparedRequest:
        """A request whose marks name styles of the palette, with notes on others; those of a table are refused."""
        table = prepared.request.text_marks
        palette = self.palette if prepared.request.has_gestures and (table or marked_styles(prepared.text)) else None
        if palette is None:
            return prepared
        check_own_styles(table, palette.names)
        return replace(prepared, text=with_styles_of(prepared.text, palette.names))

    def gesture_layer(self, prepared: PreparedRequest) -> GestureLayer | None:
        """Gestures of one clip from its beginning; None for a request without gestures."""
        request = prepared.request
        palette = self.palette if request.has_gestures else None
        if palette is None:
            return None
        method = METHODS[request.gestures]
        fields = self._fields(palette, method, has_pitch=request.pitch)
        return GestureLayer(prepared, method, fields, self.face(), self.voices.yield_turn, self._memory)

    def for_request(self, prepared: PreparedRequest, *, keeps_utterances: bool = False) -> SynthesisModels:
        """Models of a request with its own dictionary and without the tokens that it excludes.

        Parameters
        ----------
        keeps_utterances
            As for `VoicePool.voice`.
        """
        request = prepared.request
        load_voice = fitted_voices(self.voices, self.person, prepared.dictionary, keeps_utterances=keeps_utterances)
        exemplars = self._exemplars if not prepared.excluded else self._exemplars_without(prepared.excluded)
        face = self.face(has_gestures=request.has_gestures)
        face.check_articulation(request.articulation_factor)
        has_style = request.style is not None or marked_styles(prepared.text)  # without one, no palette is needed here
        palette = self.palette if request.has_gestures and has_style else None
        deliveries = NO_DELIVERIES if palette is None else palette.deliveries
        speech = SpeechModels(load_voice, self.voices.yield_turn, self._memory, deliveries)
        return SynthesisModels(self.talker, exemplars, face, speech)

    def making(self, prepared: PreparedRequest) -> Making:
        """Parts of the marks of files that a request adds: its text, the name of its voice, and who signs them."""
        return replace(prepared.making(self.person), signer=self.signer)

    def signed_by(self, signer: Signer) -> "SessionModels":
        """Models whose files are signed, which share everything else."""
        new = copy(self)
        new.signer = signer
        return new

    def seeded(self, request: Request) -> Request:
        """A request with the seed of the face, where it has none."""
        return request if request.seed is not None else replace(request, seed=self.seed)

    def pieces(self, prepared: PreparedRequest, on_heard: Progress = ignore_progress) -> Iterator[Piece]:
        """Synthesise the clip of a request piece by piece; `on_heard` is called while a recording is heard."""
        return pieces(prepared, self.for_request(prepared), self.gesture_layer(prepared), on_heard)

    @property
    def _exemplars(self) -> ExemplarModel:
        return self._once("exemplars", lambda: build_exemplar_model(self.talker))

    def _exemplars_without(self, excluded: tuple[ExcludedToken, ...]) -> ExemplarModel:
        """The exemplars without some tokens; those of the last call are cached."""
        with self._lock:
            if self._without is None or self._without[0] != excluded:
                self._without = (excluded, exclude_tokens(self._exemplars, excluded))
            return self._without[1]

    def _fields(self, palette: Palette, method: GestureMethod, *, has_pitch: bool) -> GestureFields:
        options = FIELD_OPTIONS[method.fields]
        return self._once(
            ("fields", method.fields, has_pitch),
            lambda: GestureFields(palette, options, has_pitch, has_presentation=method.has_presentation),
        )

    def _once(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Cached value of a key, computed at the first call by one thread only."""
        with self._lock:
            if key not in self._cache:
                self._cache[key] = make()
            value: Value = self._cache[key]
            return value
