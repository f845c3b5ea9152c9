"""``tts2face corpus prompts``: sentences to read aloud for a talker of one's own."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.process import write_message
from tts2face.storage.files import write_atomically
from tts2face.storage.output_names import check_file_name
from tts2face.storage.overwrite import refuse_overwriting


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
