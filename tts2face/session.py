"""The session: a talker, a face and a palette, loaded once, for synthesising any number of clips."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, TypeVar

from lexicon.dictionary import read_dictionary
from lexicon.errors import InputError
from tts2face.exemplar.synthesis import ExemplarModel, build_exemplar_model
from tts2face.exports.writer import ExportFile, ExportWriter, mesh_of, plan_exports
from tts2face.gesture.gesture_stream import GestureFields
from tts2face.gesture.ju2008 import FIELD_OPTIONS
from tts2face.models.face import Face
from tts2face.models.face_file import load_face
from tts2face.models.palette import Palette, load_palette
from tts2face.models.talker import Talker, load_talker
from tts2face.prefetch import Prefetch
from tts2face.render.encode import ClipWriter
from tts2face.render.output_path import check_output
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.request import Request
from tts2face.speech.text_fit import TextMismatch
from tts2face.storage.overwrite import refuse_overwriting
from tts2face.synthesis.animated_face import AnimatedFace, mesh_face, own_appearance_face
from tts2face.synthesis.clip_stream import Piece, SpeechSpan, SynthesisModels, measure_speech, pieces
from tts2face.synthesis.fixed_length import Length, clips_of_length
from tts2face.synthesis.gesture_layer import GestureLayer
from tts2face.synthesis.marked_speech import MarkTime
from tts2face.synthesis.performance import Performance, perform, take_clips
from tts2face.synthesis.prepared_request import PreparedRequest, input_paths, prepare
from tts2face.synthesis.written_clip import RequestSteps, WrittenClip
from tts2face.types import Clip, Progress, concatenate_clips
from tts2face.voice.engine import Voice
from tts2face.voice.pool import VoicePool

DEFAULT_FIELDS = "fields"
OWN_FACE = "self"  # name of the talker's own face
MAX_RENDERERS = 2  # renderers in memory, one for each picture; about 30 MB each
N_PIECES_AHEAD = 2  # pieces synthesised before they are drawn

Value = TypeVar("Value")


class Session:
    """A talker, a face and a palette for any number of requests.

    Talker and face are loaded by the constructor; palette, voices and renderers at their first use. All methods are
    thread-safe: a voice is used by one request at a time, and all other models are read-only. The same request, talker,
    face, palette and version give the same clip, independent of earlier and concurrent requests.

    Parameters
    ----------
    talker
        Name of a shipped talker, path of a .talker file, or a `Talker`.
    face
        Name of a shipped face, path of a .face file, a `Face`, or ``"self"`` for the talker's own face.
    identity
        Name of a preset of the face's age, sex and ancestry.
    palette
        Name of a shipped palette, path of a .palette file, or a `Palette`; None for clips without gestures.

    Raises
    ------
    InputError
        A model or identity preset does not exist, or the talker has no face of its own.
    DataError
        A file is damaged, or the face lacks landmarks or shapes that speech needs.

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
        self._cache: dict[Hashable, Any] = {}
        self._renderers: OrderedDict[Hashable, FrameRenderer] = OrderedDict()
        self._voices = VoicePool()
        self._speech_face: AnimatedFace = self._prepare_face(None)

    @property
    def palette(self) -> Palette | None:
        """Palette with the styles of the gestures; None for a session without gestures."""
        given = self._palette
        if given is None or isinstance(given, Palette):
            return given
        return self._once("palette", lambda: load_palette(str(given)))

    @property
    def mesh(self) -> Face:
        """Mesh of the face with the shapes of all channels.

        Raises
        ------
        InputError
            The face is a talker's own face, which has no mesh.
        """
        return self.face.mesh

    @property
    def face(self) -> AnimatedFace:
        """Face whose channels the clips of this session use; `tts2face.write_clip` draws clips on it."""
        palette = self.palette
        return self._speech_face if palette is None else self._once("face", lambda: self._prepare_face(palette))

    def clip(self, text: str | Request | PreparedRequest, **options: Any) -> Clip:
        """Synthesise the whole clip of a text or request.

        Parameters
        ----------
        text
            Text to speak, or a complete request, prepared or not.
        options
            Fields of `Request`, such as ``style="delighted"``; only with a text.

        Raises
        ------
        InputError
            The text is empty or contains characters that the voice cannot speak, or an option is invalid.
        DataError
            A file of the request is damaged, or the recording is silent or does not contain the words.
        BackendError
            The voice is not installed.
        """
        return concatenate_clips([piece.clip for piece in self.stream(text, **options)])

    def stream(self, text: str | Request | PreparedRequest, **options: Any) -> Iterator[Piece]:
        """Synthesise the clip of a text or request piece by piece, in bounded memory; arguments as for `clip`.

        The concatenated clips of the pieces equal the result of `clip`.
        """
        return self._pieces(prepare_request(text, options))

    def measure_speech(self, text: str | Request | PreparedRequest, **options: Any) -> SpeechSpan:
        """Seconds at which the speech of a text begins and ends in its clip, without synthesis of motion.

        The last utterances are kept, so that a following `stream` of the same text does not speak it again.
        """
        prepared = prepare_request(text, options)
        face = self._face(prepared.request.has_gestures)
        return measure_speech(prepared, self._models(prepared.request, face, keeps_utterances=True))

    def stream_to_length(self, text: str | Request | PreparedRequest, n_frames: int, **options: Any) -> Iterator[Clip]:
        """Synthesise the clip of a text or request in pieces with `n_frames` frames in total.

        Idle animation follows the speech; speech beyond the last frame is cut. Head and face are at rest in the first
        and last frame, so that such clips can be joined. Arguments and errors as `clip`.
        """
        prepared = prepare_request(text, options)
        is_text = prepared.request.audio is None and prepared.request.idle is None
        sound_end = self.measure_speech(prepared).total if is_text else None
        first = len(self._speech_face.channels) if self._mesh is None else 0  # a talker's own video fixes the rest
        yield from clips_of_length(prepared, sound_end, Length(n_frames, first), self._pieces)

    def write(
        self,
        text: str | Request | PreparedRequest,
        out: str | Path,
        *,
        picture: Picture | None = None,
        exports: Sequence[str | Path] = (),
        on_progress: Progress | None = None,
        on_piece: Callable[[Piece], None] | None = None,
        **options: Any,
    ) -> WrittenClip:
        """Synthesise, draw and encode the clip of a text or request into a file.

        Synthesis and drawing run in parallel, piece by piece.

        Parameters
        ----------
        text
            As for `clip`.
        out
            .mp4, .webm, .mov, .gif, or a folder of .png files. The file appears when it is complete; after an error no
            partial file remains.
        picture
            Drawing options; if None, fields of `Picture` may be given among the options.
        exports
            Files of other formats written beside it, by suffix, as by `tts2face.export`.
        on_progress
            Called with the number of steps done and the total: characters of a text, or parts of a recording.
        on_piece
            Called with each piece before it is drawn.
        options
            Fields of `Request` and `Picture`, such as ``style="delighted"`` or ``size="768x768"``.

        Raises
        ------
        InputError, DataError, BackendError
            As `clip`; or the file cannot be written.
        """
        picture_options = {name: options.pop(name) for name in _names(Picture) if name in options and picture is None}
        prepared = prepare_request(text, options)
        picture = picture or Picture(**picture_options)
        check_output(out)
        files = plan_exports(exports)
        refuse_overwriting(_output_names(files) | {"out": out}, input_paths(prepared.request, picture))
        renderer = self.renderer(picture, has_gestures=prepared.request.has_gestures)
        progress = RequestSteps(prepared.n_steps, on_progress)
        with (
            ClipWriter(out, renderer, on_progress=progress.report_frames) as writer,
            ExportWriter(files, face=mesh_of(self._face(prepared.request.has_gestures), files)) as copies,
        ):

            def add(piece: Piece) -> None:
                progress.begin(piece)
                copies.add(piece.clip, piece.text)
                writer.add(piece.clip)

            written = self._write_pieces(prepared, Path(out), add, on_piece)
        progress.finish()
        return replace(written, exports=tuple(file.path for file in files))

    def export(
        self,
        text: str | Request | PreparedRequest,
        paths: str | Path | Sequence[str | Path],
        *,
        on_progress: Progress | None = None,
        on_piece: Callable[[Piece], None] | None = None,
        **options: Any,
    ) -> WrittenClip:
        """Synthesise the clip of a text or request into files of other programs, without drawing it.

        Parameters
        ----------
        text, on_progress, on_piece
            As for `write`.
        paths
            Output, or several; the suffix selects the format (docs/exports.md). The files appear when all are complete.
        options
            Fields of `Request`, such as ``style="delighted"``.

        Raises
        ------
        InputError, DataError, BackendError
            As `clip` and `tts2face.export`.
        """
        prepared = prepare_request(text, options)
        files = plan_exports([paths] if isinstance(paths, str | Path) else paths)
        if not files:
            raise InputError("there is no file to export to; give at least one path")
        refuse_overwriting(_output_names(files), input_paths(prepared.request, Picture()))
        progress = RequestSteps(prepared.n_steps, on_progress)
        with ExportWriter(files, face=mesh_of(self._face(prepared.request.has_gestures), files)) as writer:

            def add(piece: Piece) -> None:
                progress.begin(piece)
                writer.add(piece.clip, piece.text)
                progress.report_piece()

            written = self._write_pieces(prepared, files[0].path, add, on_piece)
        progress.finish()
        return replace(written, exports=tuple(file.path for file in files))

    def _write_pieces(
        self,
        prepared: PreparedRequest,
        path: Path,
        add: Callable[[Piece], None],
        on_piece: Callable[[Piece], None] | None,
    ) -> WrittenClip:
        """Pass all pieces to `add` while the next ones are synthesised."""
        marks: list[MarkTime] = []
        mismatches: list[TextMismatch] = []
        seconds, n_frames = 0.0, 0
        with Prefetch(self._pieces(prepared), N_PIECES_AHEAD) as synthesised:
            for piece in synthesised:
                if on_piece:
                    on_piece(piece)
                add(piece)
                marks += piece.marks
                mismatches += piece.mismatches
                seconds += piece.clip.speech.waveform.duration
                n_frames += len(piece.clip.motion)
        return WrittenClip(path, seconds, n_frames, tuple(marks), mismatches=tuple(mismatches))

    def write_performance(
        self,
        performance: Performance,
        out: str | Path | None,
        *,
        picture: Picture | None = None,
        exports: Sequence[str | Path] = (),
        stages: Callable[[str], Progress] | None = None,
    ) -> WrittenClip:
        """Transfer a recorded performance to the session's face and write the clip to a file.

        Parameters
        ----------
        performance
            The video or capture and its options.
        out, picture, exports
            As for `write`; without `out`, only the exports are written.
        stages
            Called with the name of each stage of the work; returns the progress callback of that stage.

        Raises
        ------
        InputError, DataError, BackendError
            As `tts2face.synthesis.performance.perform`; or the file cannot be written, or is one of the inputs.
        """
        files = plan_exports(exports)
        if out is None and not files:
            raise InputError("there is no output; give out, or exports")
        if out is not None:
            check_output(out)
        picture = picture or Picture()
        inputs = {"the take": performance.take, "audio": performance.audio, "model": performance.model}
        refuse_overwriting(_output_names(files) | {"out": out}, inputs | {"background": picture.background})
        mesh_of(self._speech_face, files)  # rejects files that the face cannot fill before the video is tracked
        if out is not None:
            self.renderer(picture, has_gestures=False)  # rejects invalid options, too
        take = perform(performance, self._speech_face, on_progress=stages("tracking") if stages else None)
        n_frames = len(take.motion.face)
        draw = stages("drawing" if out is not None else "writing") if stages else None
        progress = (lambda done, _: draw(done, n_frames)) if draw else None
        with ExitStack() as stack:
            writers: list[ClipWriter | ExportWriter] = [
                stack.enter_context(ExportWriter(files, face=mesh_of(take.face, files)))
            ]
            if out is not None:  # motion may have been appended to the face
                own = take.face is self._speech_face
                renderer = self.renderer(picture, has_gestures=False) if own else take.face.renderer(picture)
                writers.append(stack.enter_context(ClipWriter(out, renderer, on_progress=progress)))
            for clip in take_clips(take.motion, take.sound):
                for writer in writers:
                    writer.add(clip)
        paths = tuple(file.path for file in files)
        path = paths[0] if out is None else Path(out)
        return WrittenClip(path, take.seconds, n_frames, is_silent=not len(take.sound.samples), exports=paths)

    def renderer(self, picture: Picture, *, has_gestures: bool = True) -> FrameRenderer:
        """Renderer of the session's face for drawing options; the last `MAX_RENDERERS` renderers are cached."""
        face, key = self._face(has_gestures), (picture, has_gestures)
        with self._lock:
            if key not in self._renderers:
                while len(self._renderers) >= MAX_RENDERERS:
                    self._renderers.popitem(last=False)
                self._renderers[key] = face.renderer(picture)
            return self._renderers[key]

    def animated_face(self, *, has_gestures: bool = True) -> AnimatedFace:
        """Face whose channels the clips of requests with or without gestures use."""
        return self._face(has_gestures)

    def _pieces(self, prepared: PreparedRequest) -> Iterator[Piece]:
        request = prepared.request
        face = self._face(request.has_gestures)
        palette = self.palette if request.has_gestures else None
        layer = None if palette is None else GestureLayer(prepared, self._fields(palette, request), face)
        return pieces(prepared, self._models(request, face), layer)

    def _models(self, request: Request, face: AnimatedFace, *, keeps_utterances: bool = False) -> SynthesisModels:
        dictionary = read_dictionary(request.dictionary).entries if request.dictionary else {}

        def borrow_voice(name: str | None, language: str) -> AbstractContextManager[Voice]:
            return self._voices.borrow(name, language, dictionary, keeps_utterances=keeps_utterances)

        return SynthesisModels(self.talker, self._exemplars, face, borrow_voice)

    def _face(self, has_gestures: bool) -> AnimatedFace:
        return self.face if has_gestures else self._speech_face

    @property
    def _exemplars(self) -> ExemplarModel:
        return self._once("exemplars", lambda: build_exemplar_model(self.talker))

    def _fields(self, palette: Palette, request: Request) -> GestureFields:
        method = request.gestures if request.gestures in FIELD_OPTIONS else DEFAULT_FIELDS  # noise has no options
        key = ("fields", method, request.pitch)
        return self._once(key, lambda: GestureFields(palette, FIELD_OPTIONS[method], with_pitch=request.pitch))

    def _prepare_face(self, palette: Palette | None) -> AnimatedFace:
        if self._mesh is None:
            return own_appearance_face(self.talker, self._exemplars, palette)
        return mesh_face(self.talker, self._exemplars, self._mesh, palette)

    def _once(self, key: Hashable, make: Callable[[], Value]) -> Value:
        """Cached value of a key, computed at the first call by one thread only."""
        with self._lock:
            if key not in self._cache:
                self._cache[key] = make()
            value: Value = self._cache[key]
            return value


def prepare_request(text: str | Request | PreparedRequest, options: dict[str, Any]) -> PreparedRequest:
    """Prepare a text with options by name, or a complete request, once.

    Raises
    ------
    InputError
        An option does not exist, or options are given together with a complete request; errors as `prepare`.
    """
    known = _names(Request)
    for name in options:
        if name not in known:
            raise InputError(f"there is no option {name!r}; the options are {', '.join(known)}")
    if isinstance(text, str):
        return prepare(Request(text=text, **options))
    if options:
        raise InputError(
            f"the option {next(iter(options))!r} cannot be given with a complete request; set it in the request"
        )
    return prepare(text) if isinstance(text, Request) else text


def _names(options: type) -> tuple[str, ...]:
    return tuple(option.name for option in fields(options) if option.name != "text")


def _output_names(files: Sequence[ExportFile]) -> dict[str, Path | str | None]:
    """Paths of exports by names for messages."""
    return {f"export {number}": file.path for number, file in enumerate(files, start=1)}
