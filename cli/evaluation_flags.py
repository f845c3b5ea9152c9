"""Flags of ``tts2face corpus evaluate``: the recordings that train and test, and what is compared."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from cli.flags import switch, whole_number
from lexicon.errors import InputError


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class SplitFlags:
    """The flags that select training and test recordings."""

    recordings: Annotated[
        Path | None, Parameter(help="Folder of recordings to split into training and held-out utterances.")
    ] = None
    hold_out: Annotated[
        int | None, whole_number("Number of utterances held out of --recordings; by default a fifth, at most 100.")
    ] = None
    seed: Annotated[int, whole_number("Seed of the random choice of held-out utterances.")] = 0
    folds: Annotated[int | None, whole_number("Number of folds for cross-validation, instead of --hold-out.")] = None
    hold_out_words: Annotated[
        str | None,
        Parameter(
            help="Instead of --hold-out: hold out utterances that contain one of these words, e.g. please,seven."
        ),
    ] = None
    train: Annotated[Path | None, Parameter(help="Folder of training recordings, instead of --recordings.")] = None
    test: Annotated[Path | None, Parameter(help="Folder of test recordings, with --train.")] = None
    cross_talker: Annotated[
        Path | None,
        Parameter(help="Test on recordings of another talker, or a Live Link Face .csv with its sound; z-scored."),
    ] = None

    def check(self) -> None:
        """Refuse flags that contradict each other."""
        if self.cross_talker is not None:
            self._check_cross_talker()
        elif (self.recordings is None) == (self.train is None) or (self.train is None) != (self.test is None):
            raise InputError("the recordings are not selected; use either --recordings, or both --train and --test")
        elif self.folds is not None and self.hold_out_words is not None:
            raise InputError("--folds cannot be combined with --hold-out-words; remove one of them")
        elif self.train is not None and (self.folds is not None or self.hold_out_words is not None):
            raise InputError(
                "--folds and --hold-out-words cannot be combined with --train and --test; use them with --recordings"
            )

    def check_people(self, people: list[Path], comparison: "ComparisonFlags") -> None:
        """Refuse flags that contradict --people."""
        if not people:
            raise InputError("--talker has no effect without --people; give a folder of tracks, or remove it")
        chosen = (self.recordings, *self._other_selections())
        if comparison.own_durations or comparison.pool is not None or any(value is not None for value in chosen):
            raise InputError(
                "--people tests a finished talker and can be combined only with --talker, --tracks, --sounds and "
                "--out; remove the other flags"
            )

    def curve_recordings(self, comparison: "ComparisonFlags") -> Path:
        """The folder of recordings of a learning curve; refuse flags that contradict --learning-curve."""
        chosen = (*self._other_selections(), comparison.tracks, comparison.pool)
        if self.recordings is None:
            raise InputError("--learning-curve needs the recordings of one person; give --recordings")
        if comparison.own_durations or any(value is not None for value in chosen):
            raise InputError(
                "--learning-curve can be combined only with --recordings, --hold-out, --seed, --base and --out; "
                "remove the other flags"
            )
        return self.recordings

    def _other_selections(self) -> tuple[object, ...]:
        """Flags that select utterances otherwise than --recordings and --hold-out."""
        return self.train, self.test, self.folds, self.hold_out_words, self.cross_talker

    def _check_cross_talker(self) -> None:
        if (self.recordings is None) == (self.train is None):
            raise InputError(
                "--cross-talker needs one folder of training recordings; use either --recordings or --train"
            )
        if self.test is not None or self.folds is not None or self.hold_out_words is not None:
            raise InputError("--cross-talker cannot be combined with --test, --folds or --hold-out-words; remove them")


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class ComparisonFlags:
    """The flags that add trajectories to the comparison."""

    own_durations: Annotated[
        bool, switch("Also evaluate synthesis from text with the durations of the default English voice.")
    ] = False
    tracks: Annotated[
        Path | None,
        Parameter(help="Also evaluate external trajectories: CSV with utterance, time and one column per channel."),
    ] = None
    sounds: Annotated[
        Path | None,
        Parameter(help="With --people: also lips from their sounds in this folder (NAME.flac), as a user gets them."),
    ] = None
    pool: Annotated[
        Path | None, Parameter(help="Train the networks also with lip tracks of this folder, as `corpus pool` does.")
    ] = None
