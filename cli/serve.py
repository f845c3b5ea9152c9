"""``tts2face serve`` and ``tts2face keys``: the HTTP service and the keys of its clients."""

import sys
from dataclasses import fields, replace
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

from cyclopts import App, Parameter

from cli.flags import add_option_flags, switch, whole_number
from cli.photo import YES, Yes, sets_up_model
from tts2face.serving.service.settings import ServiceSettings, read_settings

keys = App(name="keys", help="API keys of the service.")
SECRETS = frozenset(setting.name for setting in fields(ServiceSettings) if setting.metadata["is_secret"])


@add_option_flags(("Settings", ServiceSettings), without=SECRETS, has_defaults=False)  # lists of processes show flags
def serve(
    *,
    settings: Annotated[Path | None, Parameter(help="TOML file of settings.")] = None,
    show_config: Annotated[bool, switch("Print the settings and exit.")] = False,
    yes: Yes = False,
    **flags: Any,
) -> None:
    """Serve speech, clips and curves over HTTP (docs/http.md)."""
    chosen = read_settings(settings, flags)
    if show_config:
        sys.stdout.write(chosen.as_toml())
        return
    if yes:
        sets_up_model([YES])  # cameras, recordings and photos are read in processes without a network
    from tts2face.serving.service.server import serve as run_server

    if not chosen.studio or find_spec("nicegui") is None:
        return run_server(replace(chosen, studio=False))
    from tts2face.serving.studio.app import STUDIO

    return run_server(chosen, [STUDIO])


@keys.command
def add(  # noqa: PLR0913 - one parameter a flag
    name: Annotated[str, Parameter(help="Name of the key, in the log and the metrics.")],
    /,
    *,
    file: Annotated[Path, Parameter(help="File of keys (TOML); created if needed.")],
    scope: Annotated[list[str] | None, Parameter(help="speak, live, build, admin; several possible.")] = None,
    requests_per_minute: Annotated[int | None, whole_number("Requests a minute.")] = None,
    concurrent: Annotated[int | None, whole_number("Requests at the same time.")] = None,
    resources: Annotated[int | None, whole_number("Uploads that it may have.")] = None,
    resources_mb: Annotated[float | None, Parameter(help="MB of its uploads.")] = None,
    photos_per_day: Annotated[int | None, Parameter(help="Faces that it may make of photos in a day; 0: none.")] = None,
    speech_s_per_day: Annotated[int | None, whole_number("Seconds of speech a day.")] = None,
) -> None:
    """Create a key and print it; the file holds only its hash."""
    from tts2face.serving.service.keys import add_key

    limits = {
        "requests_per_minute": requests_per_minute, "concurrent": concurrent, "speech_s_per_day": speech_s_per_day,
        "resources": resources, "resources_mb": resources_mb, "photos_per_day": photos_per_day,
    }  # fmt: skip
    print(add_key(file, name, scope or ["speak"], **limits))  # noqa: T201 - the result


@keys.command(name="list")
def list_keys(*, file: Annotated[Path, Parameter(help="File of keys (TOML).")]) -> None:
    """List the keys of a file with their scopes and limits."""
    from tts2face.serving.service.keys import LIMITS, read_keys

    for key in read_keys(file):
        limits = [f"{limit}={value}" for limit in LIMITS if (value := getattr(key, limit)) is not None]
        print("  ".join([key.name, ",".join(key.scopes), *limits]))  # noqa: T201 - the result


@keys.command
def remove(
    name: Annotated[str, Parameter(help="Name of the key.")],
    /,
    *,
    file: Annotated[Path, Parameter(help="File of keys (TOML).")],
) -> None:
    """Remove a key; a running service drops it on SIGHUP."""
    from tts2face.serving.service.keys import remove_key

    remove_key(file, name)
    print(f"removed {name}")  # noqa: T201 - the result
