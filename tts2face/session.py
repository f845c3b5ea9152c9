"""The session: a talker, a face and a palette, loaded once, for synthesising any number of clips."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

from tts2face.models.face import Face
from tts2face.models.palette import Palette
from tts2face.models.talker import Talker
from tts2face.prefetch import Prefetch
from tts2face.render.picture import Picture
from tts2face.render.renderer import FrameRenderer
from tts2face.request import Request
from tts2face.speech.text_fit import TextMismatch
from tts2face.synthesis.animated_face import AnimatedFace
from tts2face.synthesis.clip_stream import Piece, SpeechSpan, measure_speech, pieces
from tts2face.synthesis.fixed_length import Length, clips_of_length
from tts2face.synthesis.marked_speech import MarkTime
from tts2face.synthesis.output_files import OutputFiles, plan_outputs
from tts2face.synthesis.performance import Performance, perform, take_clips
from tts2face.synthesis.prepared_request import PreparedRequest, divide_options, input_paths, prepare_request
from tts2face.synthesis.session_models import SessionModels
from tts2face.synthesis.written_clip import RequestSteps, WrittenClip
from tts2face.types import Clip, Progress, concatenate_clips

N_PIECES_AHEAD = 2  # pieces synthesised before they are drawn


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
        self._models = SessionModels(talker, face, identity, palette)

    @property
    def talker(self) -> Talker:
        """Talker whose lip motion the clips show."""
        return self._models.talker

    @property
    def palette(self) -> Palette | None:
        """Palette with the styles of the gestures; None for a session without gestures."""
        return self._models.palette

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
        return self._models.face()

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
        """Synthesise the clip of a text or request piece by piece, in bounded memory; arguments as for `clip`."""
        return self._pieces(prepare_request(text, options))

    def measure_speech(self, text: str | Request | PreparedRequest, **options: Any) -> SpeechSpan:
        """Seconds at which the speech of a text begins and ends in its clip, without synthesis of motion.

        The last utterances are kept, so that a following `stream` of the same text does not speak it again.
        """
        prepared = prepare_request(text, options)
        return measure_speech(prepared, self._models.for_request(prepared.request, keeps_utterances=True))

    def stream_to_length(self, text: str | Request | PreparedRequest, n_frames: int, **options: Any) -> Iterator[Clip]:
        """Synthesise the clip of a text or request in pieces with `n_frames` frames in total.

        Idle animation follows the speech; speech beyond the last frame is cut. Head and face are at rest in the first
        and last frame, so that such clips can be joined. Arguments and errors as `clip`.
        """
        prepared = prepare_request(text, options)
        sound_end = self.measure_speech(prepared).total if prepared.request.is_text else None
        length = Length(n_frames, self._models.n_fixed_channels)
        yield from clips_of_length(prepared, sound_end, length, self._pieces)

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
        picture_options, options = divide_options(options, Picture) if picture is None else ({}, options)
        prepared = prepare_request(text, options)
        picture = picture or Picture(**picture_options)
        outputs = plan_outputs(out, exports, input_paths(prepared.request, picture))
        return self._write(prepared, outputs, picture, on_progress, on_piece)

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
        text, on_progress, on_piece, options
            As for `write`, without fields of `Picture`.
        paths
            Output, or several; the suffix selects the format (docs/exports.md). The files appear when all are complete.

        Raises
        ------
        InputError, DataError, BackendError
            As `clip` and `tts2face.export`.
        """
        prepared = prepare_request(text, options)
        exports = [paths] if isinstance(paths, str | Path) else paths
        outputs = plan_outputs(None, exports, input_paths(prepared.request, Picture()))
        return self._write(prepared, outputs, Picture(), on_progress, on_piece)

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
        picture = picture or Picture()
        inputs = {"the take": performance.take, "audio": performance.audio, "model": performance.model}
        outputs = plan_outputs(out, exports, inputs | {"background": picture.background})
        face = self._models.speech_face
        outputs.check_face(face)  # before the video is tracked, as are the drawing options
        renderer = None if out is None else self.renderer(picture, has_gestures=False)
        take = perform(performance, face, on_progress=stages("tracking") if stages else None)
        if renderer is not None and take.face is not face:  # motion was appended to the face
            renderer = take.face.renderer(picture)
        n_frames = len(take.motion.face)
        draw = stages("writing" if renderer is None else "drawing") if stages else None
        on_frames = (lambda done, _: draw(done, n_frames)) if draw else None
        with outputs.open(take.face, renderer, on_frames) as files:
            for clip in take_clips(take.motion, take.sound):
                files.add(clip)
        is_silent = not len(take.sound.samples)
        return WrittenClip(outputs.path, take.seconds, n_frames, is_silent=is_silent, exports=outputs.export_paths)

    def renderer(self, picture: Picture, *, has_gestures: bool = True) -> FrameRenderer:
        """Renderer of the session's face for drawing options; the last few renderers are cached."""
        return self._models.renderer(picture, has_gestures=has_gestures)

    def animated_face(self, *, has_gestures: bool = True) -> AnimatedFace:
        """Face whose channels the clips of requests with or without gestures use."""
        return self._models.face(has_gestures=has_gestures)

    def _pieces(self, prepared: PreparedRequest) -> Iterator[Piece]:
        return pieces(prepared, self._models.for_request(prepared.request), self._models.gesture_layer(prepared))

    def _write(
        self,
        prepared: PreparedRequest,
        outputs: OutputFiles,
        picture: Picture,
        on_progress: Progress | None,
        on_piece: Callable[[Piece], None] | None,
    ) -> WrittenClip:
        """Write all pieces to the outputs while the next ones are synthesised."""
        has_gestures = prepared.request.has_gestures
        renderer = None if outputs.out is None else self.renderer(picture, has_gestures=has_gestures)
        progress = RequestSteps(prepared.n_steps, on_progress)
        marks: list[MarkTime] = []
        mismatches: list[TextMismatch] = []
        seconds, n_frames = 0.0, 0
        with (
            outputs.open(self._models.face(has_gestures=has_gestures), renderer, progress.report_frames) as files,
            Prefetch(self._pieces(prepared), N_PIECES_AHEAD) as synthesised,
        ):
            for piece in synthesised:
                if on_piece:
                    on_piece(piece)
                progress.begin(piece)
                files.add(piece.clip, piece.text)
                if renderer is None:
                    progress.report_piece()
                marks += piece.marks
                mismatches += piece.mismatches
                seconds += piece.clip.speech.waveform.duration
                n_frames += len(piece.clip.motion)
        progress.finish()
        return WrittenClip(
            outputs.path, seconds, n_frames, tuple(marks), mismatches=tuple(mismatches), exports=outputs.export_paths
        )
