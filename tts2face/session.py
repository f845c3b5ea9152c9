"""The Session: a talker, a face and a palette, loaded once, that turn any number of requests into clips and files."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, TypeVar

from lexicon.dictionary import read_dictionary
from lexicon.errors import InputError
from tts2face.exemplar.synthesis import ExemplarModel, build_exemplar_model
from tts2face.gesture.gesture_stream import GestureFields
from tts2face.gesture.ju2008 import FIELD_OPTIONS
from tts2face.models.face import Face
from tts2face.models.face_file import load_face
from tts2face.models.palette import Palette, load_palette
from tts2face.models.talker import Talker, load_talker
from tts2face.prefetch import Prefetch
from tts2face.render.encode import ClipWriter, write_clips
from tts2face.render.output_path import check_output
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.request import Request
from tts2face.speech.text_fit import TextMismatch
from tts2face.storage.overwrite import refuse_overwriting
from tts2face.synthesis.animated_face import AnimatedFace, mesh_face, own_appearance_face
from tts2face.synthesis.clip_stream import Performers, Piece, pieces
from tts2face.synthesis.gesture_layer import GestureLayer
from tts2face.synthesis.marked_speech import MarkTime
from tts2face.synthesis.performance import Performance, perform, take_clips
from tts2face.synthesis.prepared_request import PreparedRequest, input_paths, prepare
from tts2face.types import Clip, concatenate_clips
from tts2face.voice.engine import PronunciationMap, Voice
from tts2face.voice.loading import load_voice

DEFAULT_FIELDS = "fields"
OWN_FACE = "self"  # the face that the talker's own video shows
MAX_VOICES = 2  # idle voices by name and language; each keeps some 100 MB
RENDERERS_KEPT = 2  # by picture; each keeps some 30 MB
PIECES_AHEAD = 2  # pieces that may wait to be drawn while the next is spoken

Progress = Callable[[int, int], None]
Value = TypeVar("Value")


@dataclass(frozen=True, slots=True)
class WrittenClip:
    """What a file holds: seconds of sound, frames, and when the named marks of the text are reached.

    ``mismatches`` are words of the text that the recording probably does not say.
    """

    path: Path
    seconds: float
    n_frames: int
    marks: tuple[MarkTime, ...] = ()
    is_silent: bool = False
    mismatches: tuple[TextMismatch, ...] = ()


class Session:
    """A talker, a face and a palette that serve many requests.

    Models are loaded once, what a request needs beyond them when it is first needed. All methods may be called from
    several threads at a time: voices are lent to one request each, everything else is only read. The same request,
    talker, face, palette and version give the same clip, whatever ran before or runs beside it.

    Parameters
    ----------
    talker
        A shipped talker, a .talker file, or a talker.
    face
        A shipped face, a .face file, a face, or ``"self"`` for the talker's own face.
    identity
        A preset of the face's age, sex and ancestry.
    palette
        A shipped palette, a .palette file, or a palette; None for a face without gestures.

    Raises
    ------
    InputError
        There is no such model; the talker has no face of its own to show; the face has no such identity.
    DataError
        A file is damaged, or the face lacks what speech moves.

    Examples
    --------
    >>> session = Session()  # doctest: +SKIP
    >>> session.write("Hello there.", "hello.mp4", style="delighted")  # doctest: +SKIP
    """

    def __init__(
        self,
        talker: str | Path | Talker = "grid_s1",
        face: str | Path | Face = "head",
        *,
        identity: str | None = None,
        palette: str | Path | Palette | None = "starter",
    ) -> None:
        self.talker: Talker = talker if isinstance(talker, Talker) else load_talker(str(talker))
        if face == OWN_FACE and identity is not None:
            raise InputError("a talker's own face has no identity presets; remove the identity, or choose another face")
        self._mesh: Face | None = None
        if face != OWN_FACE:
            self._mesh = face if isinstance(face, Face) else load_face(str(face), identity)
        self._palette = palette
        self._lock = threading.RLock()
        self._kept: dict[Hashable, Any] = {}
        self._renderers: OrderedDict[Hashable, FrameRenderer] = OrderedDict()
        self._voices: OrderedDict[Hashable, list[Voice]] = OrderedDict()
        self._still_face: AnimatedFace = self._prepare_face(None)

    @property
    def palette(self) -> Palette | None:
        """The styles of the gestures."""
        given = self._palette
        if given is None or isinstance(given, Palette):
            return given
        return self._once("palette", lambda: load_palette(str(given)))

    @property
    def mesh(self) -> Face:
        """The mesh of the face, with the shapes of all channels.

        Raises
        ------
        InputError
            The face is a talker's own, which has no mesh.
        """
        return self.face.mesh

    @property
    def face(self) -> AnimatedFace:
        """The face in whose channels clips move; `tts2face.write_clip` draws them on it."""
        palette = self.palette
        return self._still_face if palette is None else self._once("face", lambda: self._prepare_face(palette))

    def clip(self, text: str | Request, **options: Any) -> Clip:
        """The whole clip of a text or request.

        Parameters
        ----------
        text
            What to say, or a request with everything.
        options
            Fields of `Request`, such as ``style="delighted"``.

        Raises
        ------
        InputError
            The text is empty or holds something that the voice cannot say, or an option is wrong.
        BackendError
            The voice is not installed.
        """
        return concatenate_clips([piece.clip for piece in self.stream(text, **options)])

    def stream(self, text: str | Request, **options: Any) -> Iterator[Piece]:
        """The clip of a text or request piece by piece, in bounded memory; arguments as for `clip`.

        The clips put together are what `clip` gives.
        """
        return self._pieces(prepare(request_of(text, options)))

    def write(
        self,
        text: str | Request,
        out: str | Path,
        *,
        picture: Picture | None = None,
        on_progress: Progress | None = None,
        on_piece: Callable[[Piece], None] | None = None,
        **options: Any,
    ) -> WrittenClip:
        """Speak, animate, draw and encode a text or request into a file.

        The next sentence is spoken while one is drawn.

        Parameters
        ----------
        out
            .mp4, .webm, .gif, or a folder of .png. It appears when all is done; after an error nothing is left.
        picture
            How the clip is drawn; without it, fields of `Picture` may stand among the options.
        on_progress
            Called with steps drawn, and steps in all: characters of a text, or parts of a recording.
        on_piece
            Called with each piece before it is drawn.
        options
            Fields of `Request` and `Picture`, such as ``style="delighted"`` or ``size="768x768"``.

        Raises
        ------
        InputError, BackendError
            As `clip`; or the file cannot be written.
        """
        of_picture = {name: options.pop(name) for name in _names(Picture) if name in options and picture is None}
        prepared = prepare(request_of(text, options))
        picture = picture or Picture(**of_picture)
        check_output(out)
        refuse_overwriting({"out": out}, input_paths(prepared.request, picture))
        renderer = self.renderer(picture, has_gestures=prepared.request.has_gestures)
        progress = _Steps(prepared.n_steps, on_progress)
        marks: list[MarkTime] = []
        mismatches: list[TextMismatch] = []
        seconds, n_frames = 0.0, 0
        with (
            Prefetch(self._pieces(prepared), PIECES_AHEAD) as spoken,
            ClipWriter(out, renderer, on_progress=progress.drawn) as writer,
        ):
            for piece in spoken:
                if on_piece:
                    on_piece(piece)
                progress.begin(piece.n_steps, n_frames)
                writer.add(piece.clip)
                marks += piece.marks
                mismatches += piece.mismatches
                seconds += piece.clip.speech.waveform.duration
                n_frames += len(piece.clip.motion)
        progress.finish()
        return WrittenClip(Path(out), seconds, n_frames, tuple(marks), mismatches=tuple(mismatches))

    def write_performance(
        self,
        performance: Performance,
        out: str | Path,
        *,
        picture: Picture | None = None,
        stages: Callable[[str], Progress] | None = None,
    ) -> WrittenClip:
        """Let a recorded person drive the session's face, and write the clip into a file.

        Parameters
        ----------
        stages
            Called with the name of each stage of the work; gives what its progress is reported to.

        Raises
        ------
        InputError, DataError, BackendError
            As `tts2face.synthesis.performance.perform`; or the file cannot be written.
        """
        check_output(out)
        picture = picture or Picture()
        self._still_face.renderer(picture)  # refuses what cannot be drawn before the take is watched
        take = perform(performance, self._still_face, on_progress=stages("watching") if stages else None)
        n_frames = len(take.motion.face)
        draw = stages("drawing") if stages else None
        clips = take_clips(take.motion, take.sound)
        progress = (lambda done, _: draw(done, n_frames)) if draw else None
        write_clips(out, clips, take.face.renderer(picture), on_progress=progress)
        return WrittenClip(Path(out), take.seconds, n_frames, is_silent=not len(take.sound.samples))

    def renderer(self, picture: Picture, *, has_gestures: bool = True) -> FrameRenderer:
        """What draws the session's face into pictures of a kind; the last `RENDERERS_KEPT` of them are kept."""
        face, key = self._face(has_gestures), (picture, has_gestures)
        with self._lock:
            if key not in self._renderers:
                while len(self._renderers) >= RENDERERS_KEPT:
                    self._renderers.popitem(last=False)
                self._renderers[key] = face.renderer(picture)
            return self._renderers[key]

    def _pieces(self, prepared: PreparedRequest) -> Iterator[Piece]:
        request = prepared.request
        face = self._face(request.has_gestures)
        palette = self.palette if request.has_gestures else None
        layer = None if palette is None else GestureLayer(prepared, self._fields(palette, request), face)
        own = read_dictionary(request.dictionary).entries if request.dictionary else {}

        def lent_voice(name: str | None, language: str) -> AbstractContextManager[Voice]:
            return self._lent_voice(name, language, own)

        performers = Performers(self.talker, self._exemplars, face, lent_voice)
        return pieces(prepared, performers, layer)

    def _face(self, has_gestures: bool) -> AnimatedFace:
        return self.face if has_gestures else self._still_face

    @property
    def _exemplars(self) -> ExemplarModel:
        return self._once("exemplars", lambda: build_exemplar_model(self.talker))

    def _fields(self, palette: Palette, request: Request) -> GestureFields:
        method = request.gestures if request.gestures in FIELD_OPTIONS else DEFAULT_FIELDS  # noise uses no options
        key = ("fields", method, request.pitch)
        return self._once(key, lambda: GestureFields(palette, FIELD_OPTIONS[method], with_pitch=request.pitch))

    def _prepare_face(self, palette: Palette | None) -> AnimatedFace:
        if self._mesh is None:
            return own_appearance_face(self.talker, self._exemplars, palette)
        return mesh_face(self.talker, self._exemplars, self._mesh, palette)

    def _once(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """What was made under a key, made now if it is the first time; by one thread only."""
        with self._lock:
            if key not in self._kept:
                self._kept[key] = make()
            kept: Value = self._kept[key]
            return kept

    @contextmanager
    def _lent_voice(self, name: str | None, language: str, own: PronunciationMap) -> Iterator[Voice]:
        """A voice for the time of a request, used by nobody else; loading one takes half a second."""
        key = (name, language, frozenset(own.items()))
        with self._lock:
            idle = self._voices.get(key)
            voice = idle.pop() if idle else None
        voice = voice or load_voice(name, language, own)
        try:
            yield voice
        finally:
            with self._lock:
                self._voices.setdefault(key, []).append(voice)
                self._voices.move_to_end(key)
                while sum(map(len, self._voices.values())) > MAX_VOICES:
                    oldest = next(iter(self._voices))
                    self._voices[oldest].pop()
                    if not self._voices[oldest]:
                        del self._voices[oldest]


def request_of(text: str | Request, options: dict[str, Any]) -> Request:
    """The request of a text and options by name.

    Raises
    ------
    InputError
        There is no such option, or options stand beside a whole request.
    """
    known = _names(Request)
    for name in options:
        if name not in known:
            raise InputError(f"there is no option {name!r}; the options are {', '.join(known)}")
    if isinstance(text, Request):
        if options:
            raise InputError(
                f"the option {next(iter(options))!r} stands beside a whole request; put it into the request"
            )
        return text
    return Request(text=text, **options)


def _names(options: type) -> tuple[str, ...]:
    return tuple(option.name for option in fields(options) if option.name != "text")


class _Steps:
    """Progress in steps of a request, while the frames of its pieces are drawn."""

    def __init__(self, of: int, on_progress: Progress | None) -> None:
        self._of, self._on_progress = of, on_progress
        self._before = self._length = self._frames_before = 0

    def begin(self, n_steps: int, n_frames_before: int) -> None:
        """The next piece begins, behind so many frames."""
        self._before += self._length
        self._length, self._frames_before = n_steps, n_frames_before

    def drawn(self, done: int, given: int) -> None:
        """So many frames are drawn, of those given to the writer so far."""
        if self._on_progress:
            share = (done - self._frames_before) / max(given - self._frames_before, 1)
            self._on_progress(min(self._of, int(self._before + self._length * share)), self._of)

    def finish(self) -> None:
        """All is drawn."""
        if self._on_progress:
            self._on_progress(self._of, self._of)
