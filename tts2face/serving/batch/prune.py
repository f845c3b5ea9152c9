"""Removal of stored segments that no manifest and no unfinished job refers to."""

import time
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path

from lexicon.errors import InputError
from tts2face.serving.batch.manifest import JSON_NAME, read_segments
from tts2face.serving.batch.store import Store

MIN_AGE_S = 86_400.0  # a younger segment may belong to a batch that is being planned or has just begun


@dataclass(frozen=True, slots=True)
class Pruned:
    """Segments and unfinished files that were removed or, in a dry run, would be, with their bytes; segments kept."""

    n_removed: int
    n_bytes: int
    n_kept: int


def prune_segments(
    store: Store, outputs: Sequence[Path], unfinished: Collection[str], older_than_s: float, *, dry_run: bool = False
) -> Pruned:
    """Remove the segments of a store that are old and to which nothing refers.

    Parameters
    ----------
    outputs
        Folders of outputs of all batches that use the store; the segments in their manifests are kept.
    unfinished
        Addresses of the segments of unfinished jobs; they are kept.
    older_than_s
        Seconds since a segment was stored; at least `MIN_AGE_S`.

    Raises
    ------
    InputError
        There is no folder of outputs or no manifest in one, or the age is too small.
    DataError
        A manifest is damaged, or does not list its segments.
    BackendError
        The store cannot be used.
    """
    if older_than_s < MIN_AGE_S:
        raise InputError(
            f"segments of the last day are never removed, as a batch may be about to use them; give --days 1 or more, "
            f"not {older_than_s / 86_400.0:g}"
        )
    if not outputs:
        raise InputError("give --outputs: the folders of clips of all batches that use the store, whose segments stay")
    for folder in outputs:
        if not (folder / JSON_NAME).is_file():
            raise InputError(f"there is no {JSON_NAME} in {folder}; give the folders of --out of `tts2face batch`")
    kept = set(unfinished).union(*(read_segments(folder) for folder in outputs))
    return prune_unused(store, kept, older_than_s, dry_run=dry_run)


def prune_unused(store: Store, kept: Collection[str], older_than_s: float, *, dry_run: bool = False) -> Pruned:
    """Remove segments and unfinished files stored some seconds ago or earlier, except those that are kept."""
    before = time.time() - older_than_s
    found = list(store.entries())
    removed = [stored for stored in found if stored.name not in kept and stored.stored_s <= before]
    abandoned = _unfinished_files(store, before)
    n_bytes = sum(stored.n_bytes for stored in removed) + sum(size for _, size in abandoned)
    if not dry_run:
        for stored in removed:
            store.remove(stored.name)
        for path, _ in abandoned:
            path.unlink(missing_ok=True)
    return Pruned(len(removed) + len(abandoned), n_bytes, len(found) - len(removed))


def _unfinished_files(store: Store, before: float) -> list[tuple[Path, int]]:
    """Old files of renderings whose process was killed, with their bytes."""
    found = []
    for path in (store.folder / "scratch").glob("*") if store.folder is not None else ():
        status = path.stat()
        # a younger file may be of a process that runs
        if path.is_file() and status.st_mtime <= before:
            found.append((path, status.st_size))
    return found
