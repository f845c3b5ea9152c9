"""Settings of the service, and its keys."""

import stat
import tomllib
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from lexicon.errors import DataError, InputError
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import add_key, find_key, read_keys
from tts2face.serving.service.settings import ServiceSettings, read_settings
from tts2face.serving.service.webhooks import check_webhook


def test_flags_win_over_the_environment_and_the_file(tmp_path: Path) -> None:
    path = tmp_path / "serve.toml"
    path.write_text('port = 1\nwaiting = 5\nbody_mb = 2\nhosts = ["a.example"]\n')
    found = read_settings(
        path, {"port": 3, "host": None}, {"TTS2FACE_SERVE_PORT": "2", "TTS2FACE_SERVE_WAITING": "6", "HOME": "/"}
    )
    assert (found.port, found.waiting, found.body_mb, found.host) == (3, 6, 2.0, "127.0.0.1")
    assert found.allowed_hosts >= {"a.example", "localhost"}


def test_shown_settings_are_a_settings_file(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "serve.toml"
    given = ServiceSettings(port=9, origins=("https://a.example",), log_text=True, keys=tmp_path / 'a "b".toml')
    path.write_text(given.as_toml())
    assert read_settings(path, environment={}) == given
    assert run(["serve", "--settings", str(path), "--show-config"]) == 0
    assert tomllib.loads(capsys.readouterr().out)["port"] == 9


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("prot = 1", "there is no 'prot' here; choose host, port"),
        ("port = '80'", 'serve.toml: port must be a whole number, not "80"'),
        ("port = 70000", "port must lie between 0 and 65535, not 70000"),
        ("hosts = 'a'", "hosts must be a list in square brackets"),
        ("log_text = 1", "must be true or false"),
        ("body_mb = 1" + "0" * 400, "body_mb is too large a number"),
        ("workers = 0x" + "f" * 5000, "workers is too large a number"),
        ("workers = 1" + "0" * 70, "workers must lie between 0 and 256, not a number of more than 60 digits"),
        ("port = ", "the settings file .*serve.toml is not TOML"),
        ("host = '0.0.0.0'", "open to everybody who reaches 0.0.0.0; create a key"),
        ("host = 'example.org'", "open to everybody"),
        ("host = ''", "open to everybody who reaches all addresses; create a key"),
        ("host = ''\nkeys = 'k.toml'", "host is empty, which would be all addresses"),
        ("hosts = ['']", "hosts must be names such as face.example.org, without a port, not ''"),
        ("hosts = ['*']", "hosts must be names such as"),
        ("hosts = ['a.example:80']", "hosts must be names such as"),
        (
            "webhook_hosts = ['']\nwebhook_secret = 'hush'",
            "webhook_hosts must be such as example.org or a.example:8080",
        ),
        ("webhook_hosts = ['*']\nwebhook_secret = 'hush'", "webhook_hosts must be such as"),
        ("webhook_hosts = ['https://a.example']\nwebhook_secret = 'hush'", "webhook_hosts must be such as"),
        ("webhook_hosts = ['a.example']", "webhook_hosts needs webhook_secret"),
        ("webhook_hosts = ['a.example']\nwebhook_secret = ' '", "webhook_hosts needs webhook_secret"),
        ("webhook_hosts = ['a.example']\nwebhook_secret = 'whsec_'", "webhook_hosts needs webhook_secret"),
        ("webhook_hosts = ['a.example']\nwebhook_secret = 'whsec_a'", "webhook_hosts needs webhook_secret"),
    ],
)
def test_wrong_settings_are_refused(tmp_path: Path, content: str, reason: str) -> None:
    path = tmp_path / "serve.toml"
    path.write_text(content)
    with pytest.raises(InputError, match=reason):
        read_settings(path, environment={})


def test_what_settings_leave_out_is_no_permission() -> None:
    """As docs/security.md lists it: nobody gets webhooks, no other page and no other name is served, no photo read."""
    plain = ServiceSettings()
    assert (plain.origins, plain.webhook_hosts, plain.photos, plain.log_text, plain.cache_mb) == (
        (),
        (),
        False,
        False,
        0,
    )
    assert plain.allowed_hosts == {"localhost", "127.0.0.1", "::1"}
    with pytest.raises(RefusedError, match="gets no webhooks"):
        check_webhook("https://example.org/done", plain)
    with pytest.raises(RefusedError, match="gets no webhooks"):
        check_webhook("https://:8080/done", plain)


@pytest.mark.parametrize(
    ("variable", "value", "reason"),
    [("PROT", "1", "unknown setting 'prot'"), ("PORT", "x", 'TTS2FACE_SERVE_PORT must be a whole number, not "x"')],
)
def test_wrong_variables_are_refused(variable: str, value: str, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_settings(environment={f"TTS2FACE_SERVE_{variable}": value})


def test_a_key_is_stored_as_a_hash_that_only_its_owner_reads(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "keys.toml"
    arguments: list[Any] = ["keys", "add", "studio", "--file", path, "--scope", "speak", "--scope", "admin"]
    assert run([str(one) for one in [*arguments, "--requests-per-minute", 60]]) == 0
    secret = capsys.readouterr().out.strip()
    assert secret not in path.read_text()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    other = add_key(path, "other", ["speak"], concurrent=2)
    keys = read_keys(path)
    found = find_key(keys, secret)
    assert found is not None
    assert (found.name, found.scopes, found.requests_per_minute) == ("studio", ("speak", "admin"), 60)
    assert find_key(keys, other) == keys[1]
    assert find_key(keys, "") is None
    assert find_key(keys, secret[:-1]) is None


def test_wrong_keys_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "keys.toml"
    add_key(path, "a", ["speak"])
    with pytest.raises(InputError, match="has a key named a already"):
        add_key(path, "a", ["speak"])
    with pytest.raises(InputError, match="no scope 'fly'; the scopes are speak, live, build, admin"):
        add_key(path, "b", ["fly"])
    with pytest.raises(InputError, match="no file of keys"):
        read_keys(tmp_path / "none.toml")
    path.write_text("[[key]]\nname = 'a'\n")
    with pytest.raises(DataError, match=r"key\[0\]: hash is missing"):
        read_keys(path)
    path.write_text("[[key]]\nname = 'a'\nhash = 'b'\nscopes = 7\n")
    with pytest.raises(DataError, match=r"key\[0\]: scopes must be a list in square brackets, not 7"):
        read_keys(path)
