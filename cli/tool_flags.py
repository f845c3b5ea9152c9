"""Flags that commands on recordings have in common: processes, folder of results, landmark model."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from cyclopts import Parameter

from cli.flags import Cache, Jobs, Model
from cli.photo import Yes

if TYPE_CHECKING:
    from corpus_tools.run_options import RunOptions


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


DEFAULTS = ToolFlags()
