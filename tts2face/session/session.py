"""The session: a talker, a face and a palette, loaded once, for synthesising any number of clips."""

from collections.abc import Callable, Iterator, Sequence
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tts2face.models.face import Face
from tts2face.models.palette import Derivation, Palette
from tts2face.models.person import parse_person
from tts2face.models.talker import Talker
from tts2face.picture.frame_renderer import FrameRenderer
from tts2face.picture.options import Picture
from tts2face.picture.pace import Pace
from tts2face.request import Request
from tts2face.session.animated_face import AnimatedFace
from tts2face.session.async_calls import AsyncCalls
from tts2face.session.encoded_stream import StreamFormat, encode_stream
from tts2face.session.fixed_length import Length, clips_of_length
from tts2face.session.live.calls import LiveCalls
from tts2face.session.outputs import (
    WrittenClip,
    plan_outputs,
    write_request,
)
from tts2face.session.prepared import PreparedRequest, input_paths, prepare_request, split_picture
from tts2face.session.shared_models import SessionModels, photographed_face, shown_face
from tts2face.session.speech_stream import Piece, SpeechSpan, measure_speech, timed_speech
from tts2face.sound.voice_pool import VoicePool
from tts2face.storage.marks import Making
from tts2face.storage.memory import ResultMemory
from tts2face.storage.signing import Signer
from tts2face.types import (
    Chunk,
    Clip,
    Progress,
    StageCallback,
    concatenate_clips,
    ignore_stage,
)

if TYPE_CHECKING:
    from tts2face.session.performance import Performance


class Session(LiveCalls, AsyncCalls):
    """A talker, a face and a palette for any number of requests.

    Talker and face are loaded by the constructor; palette, voices and renderers at their first use. All methods are
    thread-safe: a voice speaks for one caller at a time, and all other models are read-only. The same request, talker,
    face, palette and version give the same clip, independent of earlier and concurrent requests.

    Parameters
    ----------
    talker
        Name of a shipped talker, path of a .talker file, or a `Talker`.
    face
        Name of a shipped face, path of a .face file, a `Face`, or ``"self"`` for the talker's own face; None for the
        drawn woman, or for the realistic head where an identity or hair is chosen.
    identity
        Name of a preset of the face's age, sex and ancestry.
    photo, consent, smile
        Picture of a person who speaks in place of a face, that person's consent (``me``, ``agreed: NAME, YYYY-MM-DD``
        or ``nobody``), and a picture of the person's smile, as for `tts2face.face_from_photo`.
    hair, hair_color
        Haircut and colour of the hair, as for `tts2face.load_face`; None for the face's own.
    person
        Sex and age of who is shown, to which the voice is fitted where a text names none: ``female``, ``man 70``; None
        for those of the face.
    palette
        Name of a shipped palette, path of a .palette file, or a `Palette`; None for clips without gestures.
    voices
        Loaded voices shared with other sessions; None for those of this session.
    memory_mb
        Megabytes of finished sentences to keep: a request that is changed and made again, as in an editor, repeats only
        what has changed. The result is the same.

    Raises
    ------
    InputError
        A model, identity preset or haircut does not exist, or the talker has no face of its own.
    DataError
        A file is damaged, or the face lacks landmarks or shapes that speech needs.

    Examples
    --------
    >>> session = Session()  # doctest: +SKIP
    >>> session.write("Hello there.", "hello.mp4", style="delighted")  # doctest: +SKIP
    """

    def __init__(  # noqa: PLR0913 - one parameter a model
        self,
        talker: str | Path | Talker = "grid_s1",
        face: str | Path | Face | None = None,
        *,
        identity: str | None = None,
        palette: str | Path | Palette | None = "starter",
        hair: str | None = None,
        hair_color: str | None = None,
        photo: str | Path | None = None,
        consent: str | None = None,
        smile: str | Path | None = None,
        person: str | None = None,
        voices: VoicePool | None = None,
        memory_mb: float = 0.0,
    ) -> None:
        if photo is not None:
            face = photographed_face(photo, consent, smile, (face, identity, hair, hair_color))
        memory = ResultMemory(round(memory_mb * 1e6))
        mesh = shown_face(face, identity, hair, hair_color)
        self._models = SessionModels(
            talker, mesh, palette, voices, memory, person=None if person is None else parse_person(person)
        )

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

    def prepare(self, text: str | Request | PreparedRequest, **options: Any) -> PreparedRequest:
        """Parse and check a text or request once for the methods of this session; its `notes` say what is not followed.

        It has the seed of the face, where it has none, and styles of the palette in its marks. Arguments as for `clip`.
        """
        prepared = prepare_request(text, options, self._models.person).with_seed(self._models.seed)
        return self._models.with_own_styles(prepared)

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
        return self._models.pieces(self.prepare(text, **options))

    def measure_speech(self, text: str | Request | PreparedRequest, **options: Any) -> SpeechSpan:
        """Seconds at which the speech of a text begins and ends in its clip, without synthesis of motion.

        The last utterances are kept, so that a following `stream` of the same text does not speak it again.
        """
        prepared = self.prepare(text, **options)
        return measure_speech(prepared, self._models.for_request(prepared, keeps_utterances=True).speech)

    def stream_to_length(self, text: str | Request | PreparedRequest, n_frames: int, **options: Any) -> Iterator[Clip]:
        """Synthesise the clip of a text or request in pieces with `n_frames` frames in total.

        Idle animation follows the speech; speech beyond the last frame is cut. Head and face are at rest in the first
        and last frame, so that such clips can be joined. Arguments and errors as `clip`.
        """
        prepared = self.prepare(text, **options)
        sound_end = self.measure_speech(prepared).total if prepared.request.spoken is not None else None
        length = Length(n_frames, self._models.n_fixed_channels)
        yield from clips_of_length(prepared, sound_end, length, self._models.pieces)

    def stream_speech(self, text: str | Request | PreparedRequest, **options: Any) -> Iterator[Piece]:
        """Synthesise the speech of a text sentence by sentence: sound, phones and words as in its clip, no motion.

        Arguments and errors as `clip`; a recording is refused.
        """
        prepared = self.prepare(text, **options)
        return timed_speech(prepared, self._models.for_request(prepared).speech)

    def stream_file(
        self,
        text: str | Request | PreparedRequest,
        format: str = "mp4",
        *,
        picture: Picture | None = None,
        threads: int | None = None,
        pace: Pace | None = None,
        is_complete: bool = False,
        **options: Any,
    ) -> Iterator[Chunk]:
        """Synthesise and encode the clip of a text or request; yields the file in chunks while it is made.

        Parameters
        ----------
        text, picture, options
            As for `write`.
        format
            A movie (mp4 in fragments, webm), sound (wav, mp3, opus, weba: Opus in WebM, aac, flac, pcm), or lines
            (curves, oculus, azure, words, livelink), or glb or vrma, whose bytes come when it is complete. Sound alone
            needs neither lips nor phones, and starts sooner.
        threads
            Number of frames drawn in advance; None for one on each core.
        pace
            Lowers the quality of a movie that is made more slowly than it is seen; None: the quality is that of
            `picture`.
        is_complete
            The bytes come when all is made, as a file whose header has its length; a movie is that of `write`.

        Raises
        ------
        InputError, DataError, BackendError
            As `write`; or the format is unknown or cannot be transparent.
        """
        picture, options = split_picture(picture, options)
        prepared = self.prepare(text, **options)
        return encode_stream(prepared, self._models, StreamFormat(format, picture, threads, pace, is_complete))

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
        picture, options = split_picture(picture, options)
        prepared = self.prepare(text, **options)
        outputs = plan_outputs(out, exports, input_paths(prepared.request, picture))
        return write_request(prepared, self._models, outputs, picture, on_progress, on_piece)

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
        prepared = self.prepare(text, **options)
        exports = [paths] if isinstance(paths, str | Path) else paths
        outputs = plan_outputs(None, exports, input_paths(prepared.request, Picture()))
        return write_request(prepared, self._models, outputs, Picture(), on_progress, on_piece)

    def write_performance(
        self,
        performance: "Performance",
        out: str | Path | None,
        *,
        picture: Picture | None = None,
        exports: Sequence[str | Path] = (),
        stages: StageCallback | None = None,
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
            As `tts2face.session.performance.perform`; or the file cannot be written, or is one of the inputs.
        """
        picture = picture or Picture()
        inputs = {"the take": performance.take, "audio": performance.audio, "model": performance.model}
        outputs = plan_outputs(out, exports, inputs | {"background": picture.background})
        from tts2face.session.performance import write_take

        return write_take(performance, self._models, (outputs, picture), stages or ignore_stage)

    def making(self, prepared: PreparedRequest) -> Making:
        """Parts of the marks of files that a request adds: its text, the name of its voice, and who signs them."""
        return self._models.making(prepared)

    def signed_by(self, signer: Signer) -> "Session":
        """A session whose complete files are signed (C2PA, `Credentials.open`); it shares all models with this one."""
        new = copy(self)
        new._models = self._models.signed_by(signer)
        return new

    def renderer(self, picture: Picture, *, has_gestures: bool = True) -> FrameRenderer:
        """Renderer of the session's face for drawing options; the last few renderers are cached."""
        return self._models.renderer(picture, has_gestures=has_gestures)

    def animated_face(self, *, has_gestures: bool = True) -> AnimatedFace:
        """Face whose channels the clips of requests with or without gestures use."""
        return self._models.face(has_gestures=has_gestures)

    def with_style(self, name: str, derived: Derivation) -> "Session":
        """A session with one more derived style, which shares all models with this one.

        Raises
        ------
        InputError
            The name is taken or cannot be used, or the session has no palette.
        """
        new = copy(self)
        new._models = self._models.with_style(name, derived)
        return new
