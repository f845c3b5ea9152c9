"""Flags that commands on recordings have in common: processes, folder of results, landmark model."""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from cli.flags import Cache, Jobs, Model
from cli.photo import Yes

if TYPE_CHECKING:
    from corpus_tools.run_options import RunOptions

Tier = Annotated[
    str | None,
    Parameter(
        help="Tier of the words in TextGrids and other files of tiers; by default the likely one, which is said."
    ),
]


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class ToolFlags:
    """Flags of a run over recordings; ``--yes`` is read where the landmark model is missing."""

    jobs: Jobs = None
    cache: Cache = None
    model: Model = None
    yes: Yes = False

    def run_options(self) -> "RunOptions":
        """The options of the run; the tools are imported only for them."""
        from corpus_tools.run_options import RunOptions

        return RunOptions(self.cache, self.jobs, self.model)


@Parameter(name="*")
@dataclass(frozen=True, slots=True, kw_only=True)
class ReadingFlags(ToolFlags):
    """Flags of a run that reads transcripts, too."""

    tier: Tier = None

    def run_options(self) -> "RunOptions":
        """The options of the run."""
        from corpus_tools.run_options import RunOptions

        return RunOptions(self.cache, self.jobs, self.model, self.tier)


DEFAULTS, READING_DEFAULTS = ToolFlags(), ReadingFlags()
