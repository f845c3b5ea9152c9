"""``tts2face worker`` and ``tts2face jobs``: workers of a database, and control of their jobs."""

import json
import os
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from cli.flags import Sign, TimeStamp, open_signer, sign_credentials, switch, whole_number
from cli.lists import AsJson
from cli.process import WhatRemains, write_message
from lexicon.errors import InputError

if TYPE_CHECKING:
    from tts2face.serving.work.queue_control import QueuedSegment

DEFAULT_DATABASE = "tts2face-jobs.sqlite"
Database = Annotated[
    str, Parameter(help="SQLite file on a local disk, or postgresql://user@host/name for many machines.")
]
Names = Annotated[str, Parameter(help="Names of jobs, or at least six characters of each; without any, all of them.")]
WAIT_S = 0.5
SHOWN_CHARACTERS = 50  # of a text in the list
jobs = App(name="jobs", help="List, show, cancel, retry and prune the jobs of a database.")


def worker(
    *,
    database: Database = DEFAULT_DATABASE,
    store: Annotated[str, Parameter(help="Store of rendered segments that the batch uses: a folder or a URL.")],
    jobs: Annotated[int, whole_number("Number of workers on this machine.")] = 1,
    sign: Sign = None,
    time_stamp: TimeStamp = None,
) -> None:
    """Render segments and execute jobs of the service until interrupted; start one on each machine."""
    if jobs < 1:
        raise InputError(f"--jobs must be 1 or more, not {jobs}")
    from tts2face.serving.batch.store import open_store
    from tts2face.serving.work.database import database_url, prepare_database
    from tts2face.serving.work.local_workers import LocalWorkers, local_workers

    # before workers start, each of which would fail in a process of its own
    open_store(store).check()
    prepare_database(database_url(database))
    open_signer(sign, time_stamp, quiet=False)  # a wrong key is refused before workers start
    credentials = sign_credentials(sign, time_stamp)
    signing = None if credentials is None else credentials.as_json()
    wanted = LocalWorkers(database, store, jobs, on_message=write_message, signing=signing)
    write_message(
        f"{jobs} workers of {os.uname().nodename if hasattr(os, 'uname') else 'this machine'}; Ctrl-C ends them"
    )
    try:
        with local_workers(wanted) as supervise:
            while True:
                supervise()
                time.sleep(WAIT_S)
    except KeyboardInterrupt as interrupt:
        interrupt.add_note(WhatRemains("the workers have ended; others take over their segments"))
        raise


@jobs.command(name="list")
def list_jobs(
    *,
    database: Database = DEFAULT_DATABASE,
    state: Annotated[str | None, Parameter(help="waiting, running, done, failed or cancelled.")] = None,
    limit: Annotated[int | None, whole_number("Largest number of jobs.")] = None,
    as_json: AsJson = False,
) -> None:
    """List jobs with their states, workers and reasons."""
    from tts2face.serving.work.queue_control import list_jobs

    found = list_jobs(_existing(database), (state,) if state else (), limit)
    if as_json:
        print(json.dumps([asdict(segment) for segment in found], ensure_ascii=False, indent=2))  # noqa: T201 - the result
        return
    for segment in found:
        print("  ".join(_row(segment)).rstrip())  # noqa: T201 - the result
    counts = ", ".join(
        f"{sum(segment.state == name for segment in found)} {name}"
        for name in dict.fromkeys(segment.state for segment in found)
    )
    print(f"{len(found)} jobs{': ' + counts if counts else ''}")  # noqa: T201 - the result


@jobs.command
def show(
    name: Annotated[str, Parameter(help="Name of a job, or at least six characters of it.")],
    /,
    *,
    database: Database = DEFAULT_DATABASE,
) -> None:
    """Print a job and its segment as JSON."""
    from tts2face.serving.work.queue_control import show_job

    job, segment = show_job(_existing(database), name)
    print(json.dumps({**asdict(job), "segment": segment}, ensure_ascii=False, indent=2))  # noqa: T201 - the result


@jobs.command
def cancel(*names: Names, database: Database = DEFAULT_DATABASE) -> None:
    """Cancel waiting and running jobs."""
    from tts2face.serving.work.queue_control import cancel_jobs

    print(f"cancelled {cancel_jobs(_existing(database), names)} jobs")  # noqa: T201 - the result


@jobs.command
def retry(
    *names: Names,
    database: Database = DEFAULT_DATABASE,
    priority: Annotated[int | None, whole_number("New priority; smaller numbers are taken first.")] = None,
) -> None:
    """Queue failed and cancelled jobs again."""
    from tts2face.serving.work.queue_control import retry_jobs

    print(f"queued {retry_jobs(_existing(database), names, priority)} jobs again")  # noqa: T201 - the result


@jobs.command
def prune(
    *,
    database: Annotated[
        str | None, Parameter(help=f"SQLite file or postgresql://...; {DEFAULT_DATABASE} if there is one.")
    ] = None,
    days: Annotated[float, Parameter(help="Remove what ended or was stored this many days ago or earlier.")] = 0.0,
    store: Annotated[
        str | None, Parameter(help="Store whose unused segments are removed, too: a folder or a URL; needs --days 1.")
    ] = None,
    outputs: Annotated[
        tuple[Path, ...],
        Parameter(help="With --store: the folders of clips of all batches that use it; their segments stay."),
    ] = (),
    dry_run: Annotated[bool, switch("Print what would be removed; remove nothing.")] = False,
) -> None:
    """Remove jobs that have ended and, with --store, segments that no manifest and no unfinished job refers to."""
    if outputs and store is None:
        raise InputError("--outputs has no effect without --store; give both or neither")
    would = "would remove" if dry_run else "removed"
    has_database = database is not None or store is None or Path(DEFAULT_DATABASE).is_file()
    place = _existing(database or DEFAULT_DATABASE) if has_database else None
    if store is not None:
        print(f"{would} {_prune_store(store, place, outputs, days, dry_run=dry_run)}")  # noqa: T201 - the result
    if place is not None:
        from tts2face.serving.work.queue_control import prune_jobs

        print(f"{would} {prune_jobs(place, days * 86_400.0, dry_run=dry_run)} jobs")  # noqa: T201 - the result


def _prune_store(store: str, database: str | None, outputs: tuple[Path, ...], days: float, *, dry_run: bool) -> str:
    """Sentence about the content that was removed from a store."""
    from tts2face.serving.batch.prune import prune_segments
    from tts2face.serving.batch.store import open_store

    # opening it would create it, and a wrong path would look like an empty store
    if "://" not in store and not Path(store).is_dir():
        raise InputError(f"there is no store {store}; give --store as for `tts2face batch`, or its folder .segments")
    unfinished: frozenset[str] = frozenset()
    if database is not None:
        from tts2face.serving.work.queue_control import unfinished_segments

        unfinished = unfinished_segments(database)
    pruned = prune_segments(open_store(store), outputs, unfinished, days * 86_400.0, dry_run=dry_run)
    return f"{pruned.n_removed} segments ({pruned.n_bytes / 1e6:.1f} MB); {pruned.n_kept} stay"


def _existing(database: str) -> str:
    """A database that exists: control never creates one."""
    path = Path(database.removeprefix("sqlite:///"))
    if "://" not in str(database).removeprefix("sqlite:///") and not path.is_file():
        raise InputError(f"there is no database {path}; give --database as for `tts2face batch`")
    return database


def _row(segment: "QueuedSegment") -> tuple[str, ...]:
    took = "" if segment.took_s is None else f"{segment.took_s:.1f} s"
    text = segment.text if len(segment.text) <= SHOWN_CHARACTERS else f"{segment.text[:SHOWN_CHARACTERS]}..."
    return (
        segment.name[:12],
        segment.state.ljust(9),
        str(segment.priority).rjust(4),
        took.rjust(8),
        text,
        segment.reason,
    )
