"""The camera that drives the head on a page's stage, the recording of takes, and their player."""

from nicegui.element import Element

from tts2face.serving.studio.components.stage import COMPONENTS, MODULES


class Puppet(Element, component="puppet.js", esm={MODULES: str(COMPONENTS)}):
    """Camera and player of takes; the stage of the same page shows what they do.

    Parameters
    ----------
    live
        Address of the connection to which pictures go.
    upload
        Address to which recorded takes go by PUT.

    Notes
    -----
    Emits ``sent`` after a take has arrived, and ``failed`` with one sentence.
    """

    def __init__(self, live: str, upload: str) -> None:
        super().__init__()
        self._props.update(live=live, upload=upload)

    def show(self, url: str) -> None:
        """Play the take of a preview bundle."""
        self.run_method("show", url)

    def hide(self, url: str) -> None:
        """End the take of an address."""
        self.run_method("hide", url)
