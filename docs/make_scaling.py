"""Print the tables of docs/scaling.md from the measured constants.

Run: python docs/make_scaling.py [--hours 10000] [--workers 200] [--cue-s 5] [--cpu-price 0.04] [--storage-price 0.023]
"""

import argparse
import sys
from dataclasses import dataclass

# Measured (docs/performance.md), at 25 frames/s, 2 x 2 samples, the neural voice
JOIN_S = 0.08  # core seconds in which a batch joins a clip of 5 s
DATABASE_S = 0.0046  # core seconds of PostgreSQL for a job, with the polls and heartbeats of 200 workers
JOB_BYTES = 2000  # in the database, until it is pruned
WORKER_GB = 0.75  # worker and its rendering process
CONNECTIONS = 3  # of a worker
PUTS = 2  # requests that write a segment into a bucket
DATABASE_LIMIT = 680  # jobs/s of PostgreSQL on two shared cores


@dataclass(frozen=True)
class Size:
    """Core seconds of a cue of 5 s, and bytes of a second."""

    name: str
    cue_s: float
    clip_bytes: int
    segment_bytes: int


SIZES = (
    Size("512x512", 4.0, 79_000, 161_000),
    Size("1280x720", 6.8, 124_000, 206_000),
    Size("1920x1080", 13.1, 210_000, 291_000),
)


@dataclass(frozen=True)
class Wish:
    """What is to be rendered, by how many workers of a core, at which prices."""

    hours: float = 10_000
    workers: int = 200
    cue_s: float = 5.0
    cpu_price: float = 0.04  # of a core for an hour
    storage_price: float = 0.023  # of a GB for a month
    put_price: float = 0.005  # of 1,000 requests that write


def rows(wish: Wish) -> list[tuple[str, ...]]:
    """Names, and a value for each size of pictures."""
    seconds = wish.hours * 3600
    n_cues = seconds / wish.cue_s
    table: list[tuple[str, ...]] = [("", *(size.name for size in SIZES))]

    def row(name: str, *values: str) -> None:
        table.append((name, *values))

    render = [size.cue_s * wish.cue_s / 5.0 for size in SIZES]
    rates = [wish.workers / one for one in render]
    hours = [n_cues * (one + JOIN_S) / 3600 for one in render]
    row("cues", *(f"{n_cues / 1e6:.1f} million" for _ in SIZES))
    row("core hours, rendering and joining", *(f"{one:,.0f}" for one in hours))
    row(f"days with {wish.workers} workers", *(f"{n_cues / rate / 86_400:.1f}" for rate in rates))
    row("cues/s", *(f"{rate:.0f}" for rate in rates))
    row("batch processes that join them", *(f"{max(1.0, -(-rate * JOIN_S // 1)):.0f}" for rate in rates))
    row("cores of PostgreSQL", *(f"{rate * DATABASE_S:.2f}" for rate in rates))
    row("share of its limit", *(f"{100 * rate / DATABASE_LIMIT:.0f} %" for rate in rates))
    row("GB in the database without pruning", *(f"{n_cues * JOB_BYTES / 1e9:.0f}" for _ in SIZES))
    row("TB of clips", *(f"{seconds * size.clip_bytes / 1e12:.1f}" for size in SIZES))
    row("TB of segments without pruning", *(f"{seconds * size.segment_bytes / 1e12:.1f}" for size in SIZES))
    row(
        "MB/s into the store",
        *(f"{rate * wish.cue_s * size.segment_bytes / 1e6:.0f}" for rate, size in zip(rates, SIZES, strict=True)),
    )
    row("cost of cores", *(f"{one * wish.cpu_price:,.0f}" for one in hours))
    row("cost of writing segments", *(f"{n_cues * PUTS / 1000 * wish.put_price:,.0f}" for _ in SIZES))
    row("clips for a month", *(f"{seconds * size.clip_bytes / 1e9 * wish.storage_price:,.0f}" for size in SIZES))
    row("segments for a month", *(f"{seconds * size.segment_bytes / 1e9 * wish.storage_price:,.0f}" for size in SIZES))
    return table


def markdown(table: list[tuple[str, ...]]) -> str:
    """A table of Markdown."""
    lines = ["| " + " | ".join(row) + " |" for row in table]
    return "\n".join([lines[0], "|" + " --- |" * len(table[0]), *lines[1:]]).replace("|  |", "| |") + "\n"


def main() -> None:
    """Print the table for the given numbers."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, value in vars(Wish()).items():
        parser.add_argument(f"--{name.replace('_', '-')}", type=type(value), default=value)
    sys.stdout.write(markdown(rows(Wish(**vars(parser.parse_args())))))


if __name__ == "__main__":
    main()
