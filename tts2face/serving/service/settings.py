"""Settings of the service: defaults, a TOML file, environment variables, flags; the later ones win."""

import base64
import ipaddress
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, make_dataclass
from pathlib import Path
from typing import Any

from lexicon.errors import DataError, InputError
from lexicon.values.checks import EXPECTED, check_limits, format_value
from lexicon.values.fields import check_fields
from lexicon.values.files import read_text
from lexicon.values.records import checked
from lexicon.values.toml_text import parse_toml
from tts2face.sound.voice_urls import parse_named_urls
from tts2face.storage.signing import Credentials
from tts2face.storage.user_folders import user_data
from tts2face.targets.table import named_targets, parse_target

PREFIX = "TTS2FACE_SERVE_"  # of environment variables: TTS2FACE_SERVE_PORT
SECRET_PREFIX = "whsec_"  # of secrets of webhooks in base64 (Standard Webhooks)
LOCAL_HOSTS = ("localhost", "127.0.0.1", "::1")
MAX_SETTINGS_BYTES = 100_000
Limits = tuple[float, float]
_ORIGIN = re.compile(r"[a-z][a-z0-9+.-]*://[^/?#A-Z\s]+")  # as browsers send it; another one matches no page
_HOST = re.compile(r"[a-z0-9._-]+|[0-9a-f.:]*:[0-9a-f.:]*")  # a name or an address, as `Host` headers are compared
_PLACE = re.compile(r"[a-z0-9._-]+(:\d{1,5})?|[0-9a-f:.]+(:\d{1,5})?")  # of a webhook, as its URL is compared
_PASSWORD = re.compile(r"(?<=://)([^/:@]*):[^/@]*@")  # in the URL of a database


def setting(
    default: Any,
    help_text: str,
    limits: Limits | None = None,
    choices: tuple[str, ...] | None = None,
    *,
    is_secret: bool = False,
) -> Any:
    """Dataclass field with its help text, limits and choices; a secret is never shown."""
    metadata = {"help": help_text, "limits": limits, "choices": choices, "is_secret": is_secret}
    return field(default=default, repr=not is_secret, metadata=metadata)


@dataclass(frozen=True, slots=True, kw_only=True)
class ServiceSettings:
    """Settings of `tts2face serve`.

    Raises
    ------
    InputError
        A value has another type or is out of range, or the host is not this machine and there are no keys.
    """

    host: str = setting("127.0.0.1", "Address to listen on; others than this machine need keys.")
    port: int = setting(8880, "Port; 0: a free one.", (0, 65535))
    keys: Path | None = setting(None, "File of API keys, written by `tts2face keys`.")
    hosts: tuple[str, ...] = setting((), "Further host names under which clients may reach the service.")
    origins: tuple[str, ...] = setting((), "Web pages of other origins that may use the service: https://example.org.")
    talker: str = setting("grid_s1", "Talker of requests that name none.")
    face: str = setting("", "Face of requests that name none; empty: ada, or head for those with an identity or hair.")
    palette: str = setting("starter", "Palette of requests that name none.")
    voices: tuple[str, ...] = setting(
        (),
        "Voices of other servers, which get the texts, by names for clients: kokoro=http://127.0.0.1:8000/v1#af_heart.",
    )
    live_targets: tuple[str, ...] = setting(
        (),
        "Targets of live streams, by names for clients with a key of scope live: stage=rtmp://HOST/APP#key=FILE.",
    )
    data: Path | None = setting(None, "Folder of jobs, results and uploads; by default one of the user's.")
    database: str = setting("", "SQLite file or postgresql://...; empty: service.sqlite in the data folder.")
    store: str = setting("", "Folder or s3://, gs://, az:// of segments and results; empty: in the data folder.")
    workers: int = setting(1, "Job workers of this server; 0: only those of `tts2face worker`.", (0, 256))
    processes: int = setting(0, "Synthesis processes; 0: one for each core.", (0, 256))
    sessions: int = setting(2, "Sets of talker, face and palette that each process keeps in memory.", (1, 16))
    memory_mb: int = setting(
        0, "Memory of a synthesis process in MB beyond which it releases sessions; 0: any.", (0, 1e6)
    )
    cache_mb: int = setting(0, "Finished speech and clips kept in the data folder, in MB; 0: none.", (0, 1e8))
    waiting: int = setting(64, "Requests that may wait for a process; further ones are refused with 429.", (0, 10_000))
    results_days: float = setting(
        30.0, "Days after which ended jobs and their results are removed; 0: never.", (0, 36_500)
    )
    job_waiting: int = setting(100, "Waiting jobs of a key; further ones are refused with 429.", (1, 1_000_000))
    job_files: int = setting(20, "Subtitle files of a job.", (1, 1000))
    job_cues: int = setting(5000, "Cues of a job.", (1, 1_000_000))
    job_s: float = setting(14_400.0, "Longest subtitle file of a job in seconds.", (1, 1e6))
    webhook_hosts: tuple[str, ...] = setting(
        (), "Hosts that may be told of the end of jobs: example.org, a.example:8080."
    )
    webhook_secret: str = setting("", "Secret that signs webhooks; never shown.", is_secret=True)
    text_characters: int = setting(100_000, "Longest text of a request.", (1, 10_000_000))
    live_characters: int = setting(1_000_000, "Text of a live stream over its life, in characters.", (1, 1_000_000_000))
    live_characters_per_minute: int = setting(
        20_000, "Text of a live stream in a minute, in characters; more is refused.", (1, 1_000_000_000)
    )
    sound_s: float = setting(600.0, "Longest recording that a request may send.", (1, 86_400))
    body_mb: float = setting(20.0, "Largest body of a request in MB.", (0.01, 4096))
    body_s: float = setting(20.0, "Seconds within which the body of a request must arrive.", (0.1, 3600))
    video_mb: float = setting(500.0, "Largest body with a recording of a talker in MB.", (1, 1e5))
    video_s: float = setting(1800.0, "Longest recording of a talker in seconds.", (1, 86_400))
    resources: int = setting(100, "Talkers, faces, palettes and dictionaries that a key may upload.", (0, 100_000))
    resources_mb: float = setting(500.0, "MB of uploads of a key, with their pictures.", (0, 1e9))
    head_s: float = setting(10.0, "Seconds within which the head of a request must arrive.", (0.1, 3600))
    stall_s: float = setting(120.0, "Seconds for which a client may take nothing of its answer.", (0.1, 86_400))
    keep_alive_s: float = setting(15.0, "Seconds that a connection without a request stays open.", (0, 3600))
    connections: int = setting(1000, "Connections at the same time; further ones get 503.", (1, 100_000))
    head_kb: int = setting(64, "Largest head of a request in KB: address and headers.", (1, 1024))
    headers: int = setting(100, "Largest number of headers of a request.", (10, 1000))
    message_kb: int = setting(1024, "Largest message of a WebSocket in KB.", (1, 65_536))
    pixels: int = setting(2_100_000, "Largest picture of a clip in pixels.", (262_144, 16_777_216))
    upload_pixels: int = setting(40_000_000, "Largest picture that a request may send.", (1, 200_000_000))
    decode_s: float = setting(60.0, "Seconds that the decoding of an upload may take.", (1, 3600))
    drain_s: float = setting(30.0, "Seconds that running requests have to finish after SIGTERM.", (0, 3600))
    visible_mark: bool = setting(False, "Write the word synthetic into the pictures of all clips.")
    spoken_mark: str = setting(
        "", "Words before all texts that say that the voice is synthetic; auto: a sentence in their language."
    )
    sign_certificate: Path | None = setting(
        None, "Certificate (PEM) with which complete files are signed (C2PA, extra c2pa)."
    )
    sign_key: Path | None = setting(None, "Private key (PEM) of sign_certificate.")
    sign_password: str = setting("", "Password of sign_key; never shown.", is_secret=True)
    sign_authority: str = setting("", "Address of a time-stamp authority, which confirms the time of signing.")
    studio: bool = setting(True, "Serve the studio at /studio, if NiceGUI is installed (extra studio).")
    photos: bool = setting(False, "Make faces of uploaded pictures of people (extra photo).")
    photos_per_day: int = setting(50, "Faces that a key may make of pictures in a day.", (0, 1_000_000))
    warm_studio: bool = setting(True, "Make the face of new projects of the studio when the server starts.")
    sentences_mb: int = setting(
        100, "Finished sentences of the studio that each session of a synthesis process keeps, in MB.", (0, 1e5)
    )
    previews_mb: int = setting(
        300, "Previews of the studio that the server keeps, in MB; those used last stay.", (1, 1e6)
    )
    log_format: str = setting("json", "Form of the log: json or text.", choices=("json", "text"))
    log_text: bool = setting(False, "Write the texts of requests to the log.")

    def __post_init__(self) -> None:
        """Check types and limits, and that a service that others can reach has keys."""
        check_fields(self)
        for option in fields(self):
            if option.metadata["limits"] is not None:
                check_limits(option.name, getattr(self, option.name), option.metadata["limits"])
            choices, value = option.metadata["choices"], getattr(self, option.name)
            if choices is not None and value not in choices:
                raise InputError(f"{option.name} must be one of {', '.join(choices)}, not {value!r}")
        # absence is no permission: without keys only this machine may ask
        if self.keys is None and not is_loopback(self.host):
            where = self.host or "all addresses"
            raise InputError(
                f"the service would be open to everybody who reaches {where}; create a key with `tts2face keys add "
                f"NAME --file keys.toml` and give --keys keys.toml"
            )
        self._check_names()
        if (self.sign_certificate is None) != (self.sign_key is None):
            raise InputError("sign_certificate and sign_key belong together; give both or neither")
        if self.webhook_hosts and not _is_secret(self.webhook_secret):
            raise InputError(
                "webhook_hosts needs webhook_secret, which signs the messages: letters, or whsec_ and base64; give "
                "both or neither"
            )

    def _check_names(self) -> None:
        """Check names that requests are compared with: one of another form would match none, or a missing one."""
        if not self.host:
            raise InputError("host is empty, which would be all addresses; give 127.0.0.1, or 0.0.0.0 for all")
        for host in self.hosts:
            if not _HOST.fullmatch(host):
                raise InputError(f"hosts must be names such as face.example.org, without a port, not {host[:80]!r}")
        for host in self.webhook_hosts:
            if not _PLACE.fullmatch(host):
                raise InputError(f"webhook_hosts must be such as example.org or a.example:8080, not {host[:80]!r}")
        parse_named_urls(" ".join(self.voices))
        named_targets(self.live_targets)
        for origin in self.origins:
            if not _ORIGIN.fullmatch(origin):
                raise InputError(
                    f"origins must be such as https://example.org, in small letters and without a path, not {origin!r}"
                )

    @property
    def signing(self) -> dict[str, str] | None:
        """Arguments of the credentials with which complete files are signed; None where they are not."""
        if self.sign_certificate is None or self.sign_key is None:
            return None
        return Credentials(
            self.sign_certificate.absolute(), self.sign_key.absolute(), self.sign_password, self.sign_authority
        ).as_json()

    @property
    def allowed_hosts(self) -> frozenset[str]:
        """Host names that requests may name."""
        return frozenset({*LOCAL_HOSTS, self.host, *self.hosts})

    @property
    def data_folder(self) -> Path:
        """Folder of the service's data."""
        return self.data if self.data is not None else user_data() / "service"

    @property
    def database_place(self) -> str:
        """SQLite file or PostgreSQL URL of the jobs."""
        return self.database or str(self.data_folder / "service.sqlite")

    @property
    def store_place(self) -> str:
        """Folder or URL of segments and results."""
        return self.store or str(self.data_folder / "store")

    def as_toml(self) -> str:
        """The settings as a settings file, without secrets; a comment says what each means."""
        lines = []
        for option in fields(self):
            if option.metadata["is_secret"]:
                continue
            value = getattr(self, option.name)
            if option.name == "database":
                # a database's address holds its password
                value = _PASSWORD.sub(r"\1@", value)
            if option.name == "live_targets":
                # an address of a target may hold a stream key
                value = tuple(f"{name}={parse_target(place).shown}" for name, place in named_targets(value).items())
            line = f"{option.name} = {_toml(value)}" if value is not None else f'# {option.name} = ""'
            lines.append(f"# {option.metadata['help']}\n{line}\n")
        return "".join(lines)


_Written: Any = make_dataclass(
    "_Written", [(option.name, option.type, option.default) for option in fields(ServiceSettings)]
)


def _is_secret(text: str) -> bool:
    """Whether a secret signs: it is not empty, nor its base64 after `SECRET_PREFIX`."""
    if not text.startswith(SECRET_PREFIX):
        return bool(text.strip())
    try:
        return bool(base64.b64decode(text.removeprefix(SECRET_PREFIX), validate=True))
    except ValueError:
        return False


def is_loopback(host: str) -> bool:
    """Whether an address reaches this machine only."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def read_settings(
    path: Path | None = None, flags: Mapping[str, Any] | None = None, environment: Mapping[str, str] | None = None
) -> ServiceSettings:
    """Settings from a file, the environment and flags.

    Parameters
    ----------
    flags
        Values by name; None is ignored.
    environment
        Variables; None: those of this process.

    Raises
    ------
    InputError
        A name is unknown, a value has the wrong type or is out of range, or the file cannot be read.
    """
    values: dict[str, Any] = {}
    if path is not None:
        values |= _read_file(path)
    for variable, text in (os.environ if environment is None else environment).items():
        if variable.startswith(PREFIX):
            name = variable.removeprefix(PREFIX).lower()
            values[name] = _parse(_field(name, f"variable {variable}"), text, variable)
    values |= {name: value for name, value in (flags or {}).items() if value is not None}
    return ServiceSettings(**values)


def _read_file(path: Path) -> dict[str, Any]:
    try:
        content = parse_toml(read_text(path, MAX_SETTINGS_BYTES), f"the settings file {path}")
    except DataError as wrong:
        raise InputError(str(wrong)) from wrong
    except OSError as refused:
        raise InputError(f"the settings file {path} cannot be read: {refused.strerror}; check the path") from refused
    written = checked(_Written, content, str(path), InputError)
    return {name: getattr(written, name) for name in content}


def _field(name: str, source: str) -> Any:
    known = {option.name: option for option in fields(ServiceSettings)}
    if name not in known:
        raise InputError(f"the {source} has an unknown setting {name!r}; the settings are {', '.join(known)}")
    return known[name]


def _parse(option: Any, text: str, source: str) -> Any:
    """The text of an environment variable in the type of its setting."""
    kind = _kind(option)
    if kind is tuple:
        return tuple(item.strip() for item in text.split(",") if item.strip())
    if kind is bool and text.lower() in {"true", "false", "1", "0"}:
        return text.lower() in {"true", "1"}
    try:
        if kind in {int, float, str, Path}:
            return kind(text)
    except ValueError:
        pass
    raise InputError(f"{source} must be {EXPECTED[kind]}, not {format_value(text)}")


def _kind(option: Any) -> Any:
    if option.name in {"keys", "data"}:
        return Path
    return tuple if isinstance(option.default, tuple) else type(option.default)


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, int | float):
        return repr(value)
    if isinstance(value, tuple):
        return f"[{', '.join(map(_toml, value))}]"
    text = str(value).replace("\\", "\\\\").replace('"', '\\"')
    return f'"{text}"'
