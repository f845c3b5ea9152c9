"""``tts2face completion SHELL``: the script by which a shell completes commands and options."""

from typing import Annotated, Literal

from cyclopts import App, Parameter

Shell = Literal["bash", "zsh", "fish", "powershell"]


def add_completion(app: App) -> None:
    """Give an app the command that prints its completion script."""

    @app.command
    def completion(shell: Annotated[Shell, Parameter(help="The shell that reads the script.")], /) -> None:
        """Print a script that completes commands and options; save it where the shell looks for such scripts."""
        print(app.generate_completion(shell=shell))  # noqa: T201 - the answer
