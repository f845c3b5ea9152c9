"""``python -m corpus_tools.shipped.make_models [STEP ...]``: every shipped model, in the order of their needs.

It runs in a checkout of the repository. Steps that are named run alone, on what the earlier ones have written into
``--out``; with the path tracer's part, all of them take some four hours on two cores. docs/shipped.md has
a table of the steps.
"""

import argparse
import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from tts2face.types import Progress

HERE = Path(__file__).parents[1]
GRID = "grid_s1"
PROVENANCE = HERE / "provenance" / f"{GRID}.json"
TRACKS = (
    "networks learnt together with the lips of 33 minutes of White House weekly addresses (works of the United States "
    "government): 68 landmarks of github.com/acvictor/Obama-Lip-Sync at cb89642, MIT licence, Copyright (c) 2018 "
    "Ankita Victor; only their influence on shared weights is kept, no likeness"
)
# Mouths whose fitted light was better than the baked one in poses that were not fitted (docs/decisions/162).
REFINED = ("ada", "ben", "zuri")


@dataclass(frozen=True, slots=True)
class Making:
    """Where models are made.

    Parameters
    ----------
    out
        Folder of the models.
    recordings
        Folder of the recordings, with ``grid_s1``, ``address_tracks`` and ``gaze_dialogue``.
    kept
        Folder of downloads, baked poses and traced pictures, so that a step that was interrupted goes on.
    names
        Characters; empty: all.
    report
        Called with the name of each part of a step.
    """

    out: Path
    recordings: Path
    kept: Path
    names: tuple[str, ...]
    report: Callable[[str], None]

    def stage(self, name: str) -> Progress:
        """Callback of a stage, of which only the start is reported."""
        self.report(name)
        return lambda done, of: None


def make_phones(making: Making) -> None:
    """The networks that find the phones in the sound of the voice ``heart``, and in recordings: half an hour."""
    from corpus_tools.shipped.training.phone_classifier import train_recording_classifier, train_voice_classifier
    from tts2face.models.phone_classifier import write_phone_classifier

    voice = train_voice_classifier(on_progress=making.stage("the voice speaks"), report=making.report)
    write_phone_classifier(making.out / "heart.phones", voice)
    recordings = train_recording_classifier(
        making.recordings, on_progress=making.stage("damaged speech is heard"), report=making.report
    )
    write_phone_classifier(making.out / "recordings.phones", recordings)


def make_talker(making: Making) -> None:
    """The talker whose lips are the default, and the base of talkers with few recordings."""
    from corpus_tools.build_talker import build_talker
    from corpus_tools.pool_talker import pool_talker
    from corpus_tools.training.short_talker import NO_BASE

    path = making.out / f"{GRID}.talker"
    # Without base: it is the base of all others. Without consent to pictures: the corpus is about motion.
    build_talker(making.recordings / GRID, path, provenance=PROVENANCE, base=NO_BASE, stages=making.stage)
    # GRID has 51 words and lacks seven phones: its networks also learn free English, of which only the lips are known
    # (docs/decisions/124). Exemplars stay its own.
    pool_talker(str(path), making.recordings / "address_tracks", path, source=TRACKS, stages=making.stage)
    add_voices_map(making)


def add_voices_map(making: Making) -> None:
    """The audio map for live sound of any voice, in the talker that is there; a quarter of an hour."""
    from corpus_tools.shipped.training.voices_audio_map import NAME, learn_voices_map
    from tts2face.models.talker_file import load_talker, write_talker

    path = making.out / f"{GRID}.talker"
    talker = load_talker(str(path))
    learnt = learn_voices_map(
        talker, making.recordings, on_progress=making.stage("lips of damaged speech"), report=making.report
    )
    write_talker(path, replace(talker, audio_maps={**talker.audio_maps, NAME: learnt}))


def make_heads(making: Making) -> None:
    """The realistic head with its identities and the haircuts that any head can wear; calibrated with the talker."""
    from corpus_tools.shipped.head.build_head import build_all, fetch_all

    # Landmarks and proportions are tables beside the builder; shipped.head.locate measures the landmarks anew.
    build_all(fetch_all(making.kept), making.out, making.report)


def refresh_people(making: Making) -> None:
    """Tints, haircuts and brows of the identities of the head that is there, after a change of their table alone."""
    from corpus_tools.shipped.head.presets import refresh_presets

    refresh_presets(making.out / "head.face")


def part_tongues(making: Making) -> None:
    """Lips that give way to the tongue, in heads and characters that are there; builders make them so."""
    from corpus_tools.shipped.drawn.build_drawn import CAST
    from corpus_tools.shipped.head.tongue_out import refresh_tongue

    for name in making.names or ("head", *CAST):
        refresh_tongue(making.out / f"{name}.face")


def make_palette(making: Making) -> None:
    """One measured style, a seated man who reads, and what the table derives from it."""
    from corpus_tools.build_palette import StyleSource, build_style

    # Expressions are those of the head, transferred to the person; weights lie within 0 and 1 (docs/gestures.md).
    source = StyleSource(recordings=making.recordings / GRID, provenance=PROVENANCE)
    build_style(source, GRID, making.out / "starter.palette", base=None, stages=making.stage)


def derive_styles(making: Making) -> None:
    """The derived styles of the palette that is there, after a change of their table alone."""
    from corpus_tools.decomposition.derived_styles import read_derived_styles
    from tts2face.models.palette_file import load_palette, write_palette

    path = making.out / "starter.palette"
    palette = load_palette(str(path))
    (recorded,) = palette.styles
    write_palette(path, replace(palette, derivations=read_derived_styles(recorded)))


def make_gaze(making: Making) -> None:
    """How people look at a partner in conversation: a distribution over people, in some seconds."""
    from corpus_tools.shipped.training.gaze import learn_gaze
    from tts2face.models.gaze import SHIPPED, write_gaze

    write_gaze(making.out / f"{SHIPPED}.gaze", learn_gaze(making.recordings / "gaze_dialogue"))


def make_cast(making: Making) -> None:
    """Characters from MakeHuman's mesh alone, on the topology and with the shapes of the head, still without light."""
    from corpus_tools.shipped.drawn.build_drawn import CAST, build_character
    from corpus_tools.shipped.head.source import fetch_data, read_source

    source = read_source(fetch_data(making.kept))
    for name in making.names or CAST:
        build_character(source, CAST[name], making.out / f"{name}.face", making.report)


def make_light(making: Making) -> None:
    """Light of the path tracer in the characters' texels and vertices: 14 minutes each when nothing else runs."""
    from corpus_tools.shipped.drawn.build_drawn import CAST
    from corpus_tools.shipped.film.build_film import light_character
    from corpus_tools.shipped.head.source import fetch_data, read_source

    source = read_source(fetch_data(making.kept))
    for name in making.names or CAST:
        light_character(source, CAST[name], making.out, making.kept / "bakes", making.report)


def retouch(making: Making) -> None:
    """Highlights and brows that are retouched by hand, once after their light."""
    from corpus_tools.shipped.film.retouch import RETOUCHINGS, retouch_face

    for name in making.names or RETOUCHINGS:
        retouch_face(making.out / f"{name}.face")


def make_mouths(making: Making) -> None:
    """Light of mouths that is fitted to traced pictures of the baked poses, where it is the better one."""
    from corpus_tools.shipped.film.refine_film import refine_mouth
    from corpus_tools.shipped.head.source import fetch_data, read_source

    source = read_source(fetch_data(making.kept))
    for name in making.names or REFINED:
        refine_mouth(source, name, making.out / f"{name}.face", making.kept / "traced", making.report)


# The next model: a function that gets a `Making` and writes its file into `Making.out`, its row here after all that it
# needs, and its row in docs/shipped.md.
STEPS: Mapping[str, Callable[[Making], None]] = {
    "phones": make_phones,
    "talker": make_talker,
    "heads": make_heads,
    "palette": make_palette,
    "gaze": make_gaze,
    "cast": make_cast,
    "light": make_light,
    "retouching": retouch,
    "mouths": make_mouths,
}
# Parts of steps that are repeated.
ALONE: Mapping[str, Callable[[Making], None]] = {
    "styles": derive_styles,
    "voices": add_voices_map,
    "people": refresh_people,
    "tongues": part_tongues,
}


def main() -> None:
    """Make the models; steps and their start in seconds go to standard error."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    choices = [*STEPS, *ALONE]
    parser.add_argument(
        "steps", nargs="*", metavar="STEP", help=f"{', '.join(choices)}; without any: all but {', '.join(ALONE)}"
    )
    parser.add_argument("--out", type=Path, default=Path("tts2face/data"), help="folder of the models")
    parser.add_argument("--recordings", type=Path, default=Path("../shared/recordings"), help="folder of recordings")
    parser.add_argument("--keep", type=Path, default=Path.home() / ".cache/tts2face/models", help="downloads and bakes")
    parser.add_argument(
        "--names", nargs="*", default=(), help="characters of cast, light, retouching, mouths and tongues; all without"
    )
    arguments = parser.parse_args()
    unknown = [step for step in arguments.steps if step not in choices]
    if unknown:
        parser.error(f"there is no step {unknown[0]!r}; give {', '.join(choices)}")
    start = time.monotonic()

    def report(part: str) -> None:
        sys.stderr.write(f"{time.monotonic() - start:6.1f} s  {part}\n")
        sys.stderr.flush()

    arguments.out.mkdir(parents=True, exist_ok=True)
    making = Making(arguments.out, arguments.recordings, arguments.keep, tuple(arguments.names), report)
    for step in arguments.steps or STEPS:
        report(step)
        {**STEPS, **ALONE}[step](making)
    report("done")


if __name__ == "__main__":
    main()
