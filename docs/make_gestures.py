"""Measure the starter palette's measured style and its moods, and write the tables of gestures.md.

Run: python docs/make_gestures.py [speech] [styles] [moods] [gaze]; the people are those of
../shared/recordings/gaze_dialogue.
"""

import sys
from dataclasses import replace
from pathlib import Path

from corpus_tools.studies.gestures.analysis import StudyOptions, StyleStudy, TraitComparison, study_gestures
from corpus_tools.studies.gestures.gaze import GazeStudy, study_gaze
from corpus_tools.studies.gestures.moods import MoodOptions, MoodStudy, study_moods
from corpus_tools.studies.gestures.page import gaze_panels, panels_plot
from corpus_tools.studies.gestures.speech import speech_rows, study_speech
from corpus_tools.studies.gestures.write_moods import mood_rows
from tts2face.models.palette import MEASURED_STYLE
from tts2face.models.palette_file import load_palette
from tts2face.session.session import Session

PAGE = Path(__file__).with_name("gestures.md")
GAZE_PICTURE = PAGE.parent / "pictures/gaze.png"
PEOPLE = PAGE.parents[2] / "shared/recordings/gaze_dialogue"
MOODS = MoodOptions(seeds=12, first_seed=300)  # no parameter was chosen on these seeds


def distances(found: StyleStudy) -> str:
    """Markdown table of all traits, those with a target first and in bold."""
    heads = ("trait", "unit", "recorded, mean", "field")
    lines = _headed((*heads, "field / halves", "field / noise", "ju2008 / halves"))
    for one in sorted(found.trait_comparisons, key=lambda one: not one.trait.has_target):
        lines.append(_line(one))
    return "\n".join(lines)


def _line(one: TraitComparison) -> str:
    means = (float(values.mean()) for values in (one.real, one.field))
    near = [f"{one.to_field / one.halves:.2f}", f"{one.to_field / one.to_noise:.2f}"]
    published = f"{one.to_published / one.halves:.2f}"
    mark = "**" if one.trait.has_target else ""
    cells = (
        f"{mark}{one.trait.name}{mark}",
        one.trait.unit,
        *(f"{mean:.3g}" for mean in means),
        *(f"{mark}{share}{mark}" for share in near),
        published,
    )
    return f"| {' | '.join(cells)} |"


def movements(found: StyleStudy) -> str:
    """Markdown table of sound, spectra, seeds and long clips, by feature."""
    lines = _headed(
        (
            "feature",
            "r of speed with intensity: recorded",
            "field",
            "noise",
            "ju2008",
            "power above 6 Hz, of recorded",
            "ju2008",
            "diversity",
            "visited in 1 / 3 / 10 min",
        )
    )
    moving = {one.feature: one for one in found.motion_comparisons}
    for feature, visited in found.long_run.coverage.items():
        cells = [""] * 7
        if feature in moving:
            one = moving[feature]
            cells = [*(f"{r:.2f}" for r in one.with_intensity), f"{one.fast_power[0]:.2f}", f"{one.fast_power[2]:.2f}"]
            cells.append(f"{one.diversity[0]:.2f}")
        shares = " / ".join(f"{100 * share:.0f}" for share in visited)
        lines.append(f"| {feature} | {' | '.join(cells)} | {shares} % |")
    return "\n".join(lines)


def blinks(found: StyleStudy) -> str:
    """A line on how often lids shut."""
    real, field, noise, published = found.blinks_per_minute
    made = f"{field:.1f} by the field, {noise:.1f} by noise, {published:.1f} by the published field"
    return f"Blinks a minute: {real:.1f} recorded, {made}."


def moods(found: MoodStudy, measured: MoodStudy) -> str:
    """Markdown table of the moods: smile, blinks and turns of each, and how many the classifier recognises."""
    figures = _headed(("style", "recognised", "smile weight (5 to 95 %)", "blinks a minute", "yaw spread, degrees"))
    for row in [*mood_rows(found), *(row for row in mood_rows(measured) if row["mood"] == MEASURED_STYLE)]:
        is_mood = row["mood"] in found.moods
        cells = (
            row["mood"],
            f"{row['recognised']} of {row['of']}" if is_mood else "",
            f"{row['smile weight']:.2f} ({row['smile weight, 5 %']:.2f} to {row['smile weight, 95 %']:.2f})",
            f"{row['blinks a minute']:.0f}",
            f"{row['yaw spread, deg']:.1f}",
        )
        figures.append(f"| {' | '.join(cells)} |")
    n_clips, n_frames = int(found.confusion.sum()), int(found.frame_confusion.sum())
    shares = f"Of {n_clips} clips {found.accuracy:.0%} are recognised, of their {n_frames} single frames"
    summary = f"{shares} {found.frame_accuracy:.0%}."
    return "\n".join([*figures, "", summary])


def _headed(names: tuple[str, ...]) -> list[str]:
    return [f"| {' | '.join(names)} |", "| --- |" + " --- |" * (len(names) - 1)]


def gaze(found: GazeStudy) -> str:
    """Markdown table of made people against people, by state and trait."""
    lines = _headed(("state", "trait", "two people", "a made one and a person", "ratio"))
    for one in found.comparisons:
        cells = (one.state, one.trait, f"{one.people:.3f}", f"{one.made:.3f}", f"{one.made / one.people:.2f}")
        lines.append(f"| {' | '.join(cells)} |")
    return "\n".join(lines)


def style_tables() -> dict[str, str]:
    """Tables of the measured style."""
    palette = replace(load_palette("starter"), derivations={})
    (found,) = study_gestures("starter", palette, StudyOptions()).styles
    return {"distances": distances(found), "blinks": blinks(found), "movements": movements(found)}


def mood_tables() -> dict[str, str]:
    """Tables of the derived styles."""
    session = Session(face="head")  # the tracker reads its brows
    measured = study_moods(session, MOODS, ["neutral", MEASURED_STYLE])
    return {"moods": moods(study_moods(session, MOODS), measured)}


def gaze_tables() -> dict[str, str]:
    """Tables of the gaze, of which a picture is written too."""
    found = study_gaze(PEOPLE)
    GAZE_PICTURE.write_bytes(panels_plot("Gaze of people and of made people", gaze_panels(found)).png())
    return {"gaze": gaze(found)}


def speech_tables() -> dict[str, str]:
    """The table of what head, brows and blinks do in speech, beside people."""
    lines = _headed(("what", "unit", "made", "95 %", "people"))
    lines += [f"| {' | '.join(row)} |" for row in speech_rows(study_speech(Session()))]
    return {"speech": "\n".join(lines)}


PARTS = {"speech": speech_tables, "styles": style_tables, "moods": mood_tables, "gaze": gaze_tables}


def main() -> None:
    """Measure and write the parts that are named, or all."""
    tables: dict[str, str] = {}
    for part in sys.argv[1:] or PARTS:
        tables |= PARTS[part]()
    page = PAGE.read_text(encoding="utf-8")
    for name, table in tables.items():
        begin, end = f"<!-- {name} -->\n", f"<!-- end of {name} -->"
        before, _, rest = page.partition(begin)
        _, _, behind = rest.partition(end)
        page = f"{before}{begin}{table}\n{end}{behind}"
    PAGE.write_text(page, encoding="utf-8")


if __name__ == "__main__":
    main()
