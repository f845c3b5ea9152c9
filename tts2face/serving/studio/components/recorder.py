"""The recorder of the recording page, and the map of the visemes that its takes cover."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from nicegui.element import Element

from tts2face.serving.studio.components.stage import COMPONENTS, MODULES

# seconds of a take
LONGEST_S = 30.0
STYLE = Path(__file__).with_name("recorder.css")


class Recorder(Element, component="recorder.js", esm={MODULES: str(COMPONENTS)}):
    """Prompts, camera and microphone; sends each take by PUT to `upload` followed by the index of its prompt.

    Parameters
    ----------
    takes
        State and advice of each take, by the index of its prompt.
    first
        Index of the prompt that is shown first.
    longest
        Seconds after which a forgotten take ends by itself.

    Notes
    -----
    Emits ``sent`` with the index of a take that has arrived, ``remove`` with that of one to delete, ``select`` with
    that of the prompt that is shown.
    """

    def __init__(
        self, prompts: Sequence[str], takes: Mapping[int, Mapping[str, str]], upload: str, first: int = 0,
        *, longest: float = LONGEST_S,
    ) -> None:  # fmt: skip
        super().__init__()
        self._props.update(prompts=list(prompts), takes=_by_name(takes), upload=upload, first=first, longest=longest)

    def set_takes(self, takes: Mapping[int, Mapping[str, str]]) -> None:
        """Show other states of the takes."""
        self._props["takes"] = _by_name(takes)
        self.update()


class VisemeMap(Element, component="viseme_map.js"):
    """Visemes by those behind them, each cell as dark as much of running text is covered.

    Parameters
    ----------
    prompts, running
        As the tool ``recordings`` gives them.
    visemes
        The viseme of each phone.
    """

    def __init__(
        self, prompts: Sequence[Mapping[str, Any]], running: Mapping[str, Any], visemes: Mapping[str, str]
    ) -> None:
        super().__init__()
        units = [{"phones": prompt["phones"], "triphones": prompt["triphones"]} for prompt in prompts]
        self._props.update(prompts=units, running=dict(running), accepted=[], visemes=dict(visemes))

    def set_accepted(self, accepted: Sequence[int]) -> None:
        """Show what the prompts of these indices cover."""
        self._props["accepted"] = list(accepted)
        self.update()


def _by_name(takes: Mapping[int, Mapping[str, str]]) -> dict[str, dict[str, str]]:
    return {str(at): dict(take) for at, take in takes.items()}
