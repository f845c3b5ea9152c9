"""``tts2face "text"``: write, explain or show a clip from the parsed flags."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING

from cli.process import return_large_blocks, write_message
from cli.progress import compilation_messages, progress_bar
from lexicon.errors import InputError
from tts2face.models.person import seed_of
from tts2face.picture.options import Picture
from tts2face.processes.collection import resume_collection
from tts2face.request import OWN_FACE, FromPhones, Recorded, Request, Spoken
from tts2face.session.named_models import Models
from tts2face.storage.files import write_atomically
from tts2face.storage.output_paths import check_file_name, refuse_overwriting

if TYPE_CHECKING:
    from tts2face.lips.explanation import PhoneExplanation
    from tts2face.session.outputs import WrittenClip
    from tts2face.session.prepared import PreparedRequest
    from tts2face.session.session import Session
    from tts2face.session.speech_stream import Piece
    from tts2face.sound.alignment import TextMismatch
    from tts2face.sound.voice_pool import VoicePool
    from tts2face.storage.signing import Signer
    from tts2face.types import Progress

EXPLANATION_SUFFIXES = (".json", ".txt")
WITHOUT_WORDS = (
    "the words are not given: lips follow the English phones that are heard; with the words (--text) they agree better "
    "with the person's (r of the opening .74 in place of .62)"
)


@dataclass(frozen=True, slots=True)
class SpeakOptions:
    """The flags that belong neither to the request nor to the picture."""

    out: Path | None
    models: Models
    explain: Path | None
    view: bool
    quiet: bool
    file: Path | None = None
    exports: tuple[str, ...] = ()
    out_is_export: bool = False  # then it is the first of the exports
    signer: "Signer | None" = None

    def with_export_of_out(self) -> "SpeakOptions":
        """The same options, with an output in an export format as an export."""
        from tts2face.interchange.exports.table import is_export

        if self.out is None or not is_export(self.out):
            return self
        return replace(self, out=None, exports=(str(self.out), *self.exports), out_is_export=True)


def run_request(request: Request, picture: Picture, options: SpeakOptions) -> None:
    """Write, explain or show a clip of a request."""
    _check_options(request, picture, options)
    from tts2face.session.prepared import prepare

    # a wrong request is refused before anything is loaded
    run_prepared(prepare(request, options.models.shown_person()), picture, options)


def run_prepared(prepared: "PreparedRequest", picture: Picture, options: SpeakOptions) -> None:
    """Write, explain or show a clip of a prepared request."""
    _check_options(prepared.request, picture, options)
    with compilation_messages(options.quiet):
        _make(prepared, picture, options)


def _make(prepared: "PreparedRequest", picture: Picture, options: SpeakOptions) -> None:
    from tts2face.sound.voice_pool import VoicePool

    _write_notes(prepared.notes, options)
    voices = VoicePool()
    person = options.models.shown_person()
    fitting = prepared.fitting(person)
    if fitting is not None and fitting.sentence and not options.quiet:
        write_message(f"tts2face: note: {fitting.sentence}")
    prepared.preload_voice(voices, person)  # beside the imports of the session, and loading of talker and face
    if not _write_speech(prepared, picture, options, voices):
        _write_clip(prepared, picture, options, voices)


def _write_notes(notes: Sequence[str], options: SpeakOptions) -> None:
    for note in () if options.quiet else notes:
        write_message(f"tts2face: note: {note}")


def _write_clip(prepared: "PreparedRequest", picture: Picture, options: SpeakOptions, voices: "VoicePool") -> None:
    _tell_what_is_heard(prepared.request, options)
    session = _open_session(options, voices)
    n_known, prepared = len(prepared.notes), session.prepare(prepared)
    _write_notes(prepared.notes[n_known:], options)
    resume_collection()
    explanations: list[PhoneExplanation] = []

    def collect(piece: "Piece") -> None:
        if options.explain is not None:
            explanations.extend(piece.explain())

    if options.out is not None or options.exports:
        _write_files(session, (prepared, picture), options, collect)
    elif options.explain is not None:
        for piece in session.stream(prepared):
            collect(piece)
            _warn_mismatches(piece.mismatches)
    if options.explain is not None:
        voice = prepared.fitting(options.models.shown_person())
        _write_explanation(tuple(explanations), options.explain, "" if voice is None else voice.described)
    if options.view:
        from tts2face.picture.window import show_clip

        show_clip(session.clip(prepared), session.mesh, picture)


def _check_options(request: Request, picture: Picture, options: SpeakOptions) -> None:
    """Refuse conflicting flags before anything is loaded."""
    if options.out is None and not options.exports and options.explain is None and not options.view:
        raise InputError("there is no output; add --out clip.mp4 (or .webm, .gif, or a folder for .png files)")
    if options.explain is not None:
        check_file_name(options.explain, "an explanation", EXPLANATION_SUFFIXES)
    _check_overwriting(request, picture, options)
    _check_exports(options)
    source = request.source
    has_phones = isinstance(source, Recorded) and isinstance(source.lips, FromPhones)
    needs_text = isinstance(source, Spoken) or (options.explain is not None and not has_phones)
    if needs_text and not source.text.strip():
        raise InputError("the text is empty; add words to speak, or the words of --audio")
    if options.view:
        # it consists of pictures of a video, and the window draws meshes
        if options.models.face == OWN_FACE:
            raise InputError("--view cannot show the talker's own face; remove it, or use --face head")
        from tts2face.picture.display import require_display

        require_display("--view")


def _check_overwriting(request: Request, picture: Picture, options: SpeakOptions) -> None:
    from tts2face.session.prepared import input_paths

    inputs = {f"--{name}": path for name, path in input_paths(request, picture).items()}
    models = {"--talker": options.models.talker, "--face": options.models.face, "--palette": options.models.palette}
    from tts2face.interchange.exports.table import split_format

    outputs = {"--out": options.out, "--explain": options.explain}
    for number, given in enumerate(options.exports):
        name = "--out" if number == 0 and options.out_is_export else f"--export {given}"
        outputs[name] = split_format(given)[0]
    refuse_overwriting(outputs, {"--file": options.file} | models | inputs)


def _check_exports(options: SpeakOptions) -> None:
    if options.exports:
        from tts2face.interchange.exports.writer import plan_exports

        plan_exports(options.exports)


def _write_files(
    session: "Session",
    request_and_picture: "tuple[PreparedRequest, Picture]",
    options: SpeakOptions,
    on_piece: Callable[["Piece"], None],
) -> None:
    """Write the clip and the exports, or only the exports."""
    request, picture = request_and_picture

    def write(on_progress: "Progress") -> "WrittenClip":
        if options.out is None:
            return session.export(request, options.exports, on_progress=on_progress, on_piece=on_piece)
        return session.write(
            request,
            options.out,
            picture=picture,
            exports=options.exports,
            on_progress=on_progress,
            on_piece=on_piece,
        )

    _report_writing(write, options)


def _write_speech(prepared: "PreparedRequest", picture: Picture, options: SpeakOptions, voices: "VoicePool") -> bool:
    """Write exports that hold no motion without loading the shipped models; False if models are needed or chosen."""
    if options.out is not None or not options.exports or options.explain is not None or options.view:
        return False
    # a wrong name would pass unnoticed if nothing loaded it
    if options.models != Models():  # others are checked while they are loaded
        return False
    from tts2face.session.outputs import is_speech_only, plan_outputs, write_speech
    from tts2face.session.prepared import input_paths

    outputs = plan_outputs(None, options.exports, input_paths(prepared.request, picture))
    if not is_speech_only(prepared, outputs):
        return False
    person, seeded = options.models.shown_person(), prepared.with_seed(seed_of(options.models.description()))
    _report_writing(
        lambda on_progress: write_speech(seeded, outputs, voices, on_progress, person, options.signer), options
    )
    return True


def _report_writing(write: "Callable[[Progress], WrittenClip]", options: SpeakOptions) -> None:
    """Write with a progress bar and print a summary."""
    resume_collection()
    began = time.perf_counter()
    with progress_bar("writing" if options.out is None else "rendering", options.quiet) as on_progress:
        has_begun = False

        def report(done: int, of: int) -> None:
            nonlocal has_begun
            # from the first picture on; before it, mapping each block costs more (`FIRST_BYTES`)
            if not has_begun:
                return_large_blocks()
                has_begun = True
            on_progress(done, of)

        written = write(report)
    _warn_mismatches(written.mismatches)
    if options.quiet:
        return
    took = time.perf_counter() - began
    write_message(
        f"wrote {written.names}: {written.seconds:.1f} s, {written.n_frames} frames, "
        f"made in {took:.1f} s ({written.seconds / took:.1f} x real time)"
    )
    for mark in written.marks:
        write_message(f"{mark.seconds:.2f} s: {mark.name}")


def _tell_what_is_heard(request: Request, options: SpeakOptions) -> None:
    """Say what to expect of a recording without words."""
    if not options.quiet and isinstance(request.source, Recorded) and request.source.lips == FromPhones():
        write_message(WITHOUT_WORDS)


def _warn_mismatches(mismatches: "Sequence[TextMismatch]") -> None:
    """Warn of each span of a recording that does not match its text; also with --quiet, as the clip is wrong there."""
    for mismatch in mismatches:
        write_message(f"tts2face: warning: {mismatch.sentence}")


def _open_session(options: SpeakOptions, voices: "VoicePool") -> "Session":
    from tts2face.picture.film import check_output

    if options.out is not None:
        check_output(options.out)
    session = open_session(options.models, voices, draws=options.out is not None or options.view)
    return session if options.signer is None else session.signed_by(options.signer)


def open_session(models: Models, voices: "VoicePool | None" = None, *, draws: bool) -> "Session":
    """Session of models, with the kernels that it needs; those of pictures, too, if it draws."""
    from tts2face.session.warm_up import compile_kernels, kernels_are_compiled

    draws = draws and models.face != OWN_FACE
    if not kernels_are_compiled(None):  # the first run: before models are read, which needs some of the kernels
        compile_kernels(models.shown_face() if draws else None)
    session = models.open_session(voices)
    drawn = session.face.mesh if draws else None
    if not kernels_are_compiled(drawn):
        compile_kernels(drawn)
    return session


def _write_explanation(explanations: "tuple[PhoneExplanation, ...]", path: Path, voice: str) -> None:
    from tts2face.lips.explanation import explanation_json, explanation_text

    is_json = path.suffix == ".json"
    if is_json:
        said = {"voice": voice} if voice else {}
        text = dumps([phone | said for phone in explanation_json(explanations)], ensure_ascii=False)
    else:
        text = (f"voice: {voice}\n" if voice else "") + explanation_text(explanations)
    write_atomically(path, text.encode())
