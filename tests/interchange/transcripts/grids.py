"""TextGrids that tests make."""

from collections.abc import Sequence

Row = tuple[float, float, str]
WORDS: Sequence[Row] = (
    (0, 0.55, ""), (0.55, 0.75, "bin"), (0.75, 1.05, "red"), (1.05, 1.25, "by"), (1.25, 1.5, "k"),
    (1.5, 1.9, "seven"), (1.9, 2.3, "now"), (2.3, 2.95, ""),
)  # fmt: skip
PHONES: Sequence[Row] = (
    (0, 0.55, "#"), (0.55, 0.62, "b"), (0.62, 0.69, "I"), (0.69, 0.75, "n"), (0.75, 0.85, "r"), (0.85, 0.95, "E"),
    (0.95, 1.05, "d"), (1.05, 1.12, "b"), (1.12, 1.25, "aI"), (1.25, 1.35, "k"), (1.35, 1.5, "eI"), (1.5, 2.95, "#"),
)  # fmt: skip


def textgrid(**tiers: Sequence[Row]) -> str:
    """A TextGrid of interval tiers in Praat's long form; _ in a name is a space."""
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "xmin = 0", "xmax = 2.95", "tiers? <exists>"]
    lines += [f"size = {len(tiers)}", "item []:"]
    for at, (name, rows) in enumerate(tiers.items(), start=1):
        lines += [f"    item [{at}]:", '        class = "IntervalTier"', f'        name = "{name.replace("_", " ")}"']
        lines += ["        xmin = 0", "        xmax = 2.95", f"        intervals: size = {len(rows)}"]
        for number, (start, end, label) in enumerate(rows, start=1):
            quoted = label.replace('"', '""')
            lines += [f"        intervals [{number}]:", f"            xmin = {start!r}", f"            xmax = {end!r}"]
            lines += [f'            text = "{quoted}" ']
    return "\n".join(lines) + "\n"


def relabelled(rows: Sequence[Row], **labels: str) -> list[Row]:
    """Rows with other labels in place of some; ``empty`` stands for the empty one."""
    new = {("" if old == "empty" else old): label for old, label in labels.items()}
    return [(start, end, new.get(label, label)) for start, end, label in rows]
