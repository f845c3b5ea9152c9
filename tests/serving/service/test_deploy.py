"""The deployment files and the pages about them: every setting, flag and test that they name exists."""

import json
import re
import shlex
import shutil
import subprocess
import tomllib
from collections.abc import Iterator
from dataclasses import fields
from pathlib import Path
from typing import Any

import pytest
import yaml

from cli.flags import check_options, option_names
from cli.main import app
from tests.docs.blocks import DOCS, ROOT
from tts2face.serving.service.settings import PREFIX, ServiceSettings, read_settings

FOLDER = DOCS / "deploy"
FILES = sorted(path for path in FOLDER.iterdir() if path.is_file())
NAMES = {one.name for one in fields(ServiceSettings)}
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]


def instructions() -> list[tuple[str, str]]:
    """Instructions of the Dockerfile with their arguments; lines that go on are joined, comments removed."""
    text = re.sub(r"^#.*\n", "", (FOLDER / "Dockerfile").read_text(), flags=re.MULTILINE).replace("\\\n", " ")
    return [(line.split()[0], line.split(None, 1)[1]) for line in text.splitlines() if line.strip()]


def unit() -> dict[str, list[str]]:
    """Values of the unit's settings."""
    found: dict[str, list[str]] = {}
    for line in (FOLDER / "tts2face.service").read_text().splitlines():
        name, is_setting, value = line.partition("=")
        if is_setting and not line.startswith("#"):
            found.setdefault(name, []).append(value)
    return found


def compose() -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load((FOLDER / "compose.yaml").read_text())
    return content


def objects() -> list[dict[str, Any]]:
    return list(yaml.safe_load_all((FOLDER / "kubernetes.yaml").read_text()))


def of_kind(kind: str) -> list[dict[str, Any]]:
    return [one for one in objects() if one["kind"] == kind]


def pods() -> Iterator[tuple[str, dict[str, Any], dict[str, Any]]]:
    """Name, pod and container of each deployment."""
    for one in of_kind("Deployment"):
        pod = one["spec"]["template"]["spec"]
        (container,) = pod["containers"]
        yield one["metadata"]["name"], pod, container


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_variable_of_the_service_is_a_setting(path: Path) -> None:
    named = set(re.findall(rf"{PREFIX}([A-Z_]+)", path.read_text()))
    assert {name.lower() for name in named} <= NAMES


def test_the_settings_file_is_valid(tmp_path: Path) -> None:
    keys = tmp_path / "keys.toml"
    settings = read_settings(FOLDER / "serve.toml", {"keys": keys}, {})
    assert settings.host == "0.0.0.0"
    assert settings.drain_s < float(unit()["TimeoutStopSec"][0])


def test_values_of_variables_are_valid(tmp_path: Path) -> None:
    server = compose()["services"]["server"]["environment"]
    pod = of_kind("ConfigMap")[0]["data"]
    for variables in (server, pod):
        own = {name: str(value) for name, value in variables.items() if name.startswith(PREFIX)}
        assert read_settings(None, {"keys": tmp_path / "keys.toml"}, own).workers == 0


def test_command_lines_are_understood() -> None:
    lines = [shlex.split(unit()["ExecStart"][0])[1:], json.loads(dict(instructions())["CMD"])]
    lines += [container["args"] for _, _, container in pods()]
    lines.append(shlex.split(compose()["services"]["worker"]["entrypoint"][2].removeprefix("exec "))[1:])
    for words in lines:
        check_options(app, words)
        app.parse_args(words, exit_on_error=False, print_error=False)


def test_the_image_is_built_as_the_pages_say() -> None:
    """The packages are those of the pages; extras exist; nothing is installed by apt, as nothing else is needed."""
    steps = instructions()
    assert [name for name, _ in steps].count("FROM") == 2
    assert all(re.fullmatch(r"python:3\.1[123]-slim( AS build)?", what) for name, what in steps if name == "FROM")
    runs = " ".join(what for name, what in steps if name == "RUN")
    (extras,) = re.findall(r"pip install --no-cache-dir '\.\[([a-z,]+)\]'", runs)
    assert set(extras.split(",")) == {"service", "postgres", "otel"}
    assert set(extras.split(",")) <= set(EXTRAS)
    assert "pip install '.[service]'" in (DOCS / "http.md").read_text()
    assert not re.search(r"apt|curl|wget|https?://", runs)
    assert dict(steps)["USER"] == "10001:10001"
    assert {"HEALTHCHECK", "ENTRYPOINT", "CMD", "VOLUME", "STOPSIGNAL"} <= {name for name, _ in steps}
    assert json.loads(dict(steps)["HEALTHCHECK"].split("CMD", 1)[1])[0] == "python"
    last_stage = [name for name, _ in steps][[name for name, _ in steps].index("FROM", 1) :]
    assert last_stage.index("USER") < last_stage.index("CMD")


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="needs systemd-analyze")
def test_systemd_reads_the_unit(tmp_path: Path) -> None:
    text = re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", (FOLDER / "tts2face.service").read_text(), flags=re.M)
    path = tmp_path / "tts2face.service"
    path.write_text(text)
    done = subprocess.run(["systemd-analyze", "verify", path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_the_unit_is_hardened() -> None:
    found = unit()
    expected = {
        "DynamicUser": "yes", "ProtectSystem": "strict", "ProtectHome": "yes", "NoNewPrivileges": "yes",
        "PrivateTmp": "yes", "CapabilityBoundingSet": "", "RestrictNamespaces": "user net", "MemoryMax": "6G",
    }  # fmt: skip
    assert {name: found[name] for name in expected} == {name: [value] for name, value in expected.items()}
    assert "MemoryDenyWriteExecute" not in found  # numba compiles kernels


def test_containers_have_no_rights() -> None:
    services = compose()["services"]
    for name in ("server", "worker"):
        one = services[name]
        assert one["read_only"] is True
        assert one["cap_drop"] == ["ALL"]
        assert one["security_opt"] == ["no-new-privileges:true"]
        assert one["tmpfs"] == ["/tmp"]
        assert one["mem_limit"]
    for name, pod, container in pods():
        rights = container["securityContext"]
        assert rights == {
            "allowPrivilegeEscalation": False, "readOnlyRootFilesystem": True, "capabilities": {"drop": ["ALL"]}
        }, name  # fmt: skip
        assert pod["securityContext"]["runAsNonRoot"] is True
        assert pod["automountServiceAccountToken"] is False
        assert container["resources"]["limits"]["memory"]
        mounted = {mount["name"] for mount in container["volumeMounts"]}
        assert mounted == {volume["name"] for volume in pod["volumes"]}


def test_probes_name_a_host_that_is_served() -> None:
    _, pod, container = next(pods())
    for kind in ("startupProbe", "readinessProbe", "livenessProbe"):
        get = container[kind]["httpGet"]
        assert get["path"] in {"/readyz", "/healthz"}
        assert get["httpHeaders"] == [{"name": "Host", "value": "localhost"}]
    pause = float(container["lifecycle"]["preStop"]["exec"]["command"][1])
    drain = float(of_kind("ConfigMap")[0]["data"][f"{PREFIX}DRAIN_S"])
    assert pod["terminationGracePeriodSeconds"] > pause + drain


def test_several_servers_and_workers_stand_behind_one_balancer() -> None:
    services = compose()["services"]
    assert services["server"]["deploy"]["replicas"] >= 2
    assert services["worker"]["deploy"]["replicas"] >= 2
    assert "proxy_buffering off" in compose()["configs"]["balancer"]["content"]
    assert [one["spec"]["replicas"] >= 2 for one in of_kind("Deployment")] == [True, True]


def test_proxies_let_through_what_the_service_takes() -> None:
    largest = f"{ServiceSettings().video_mb:g}m"
    assert f"client_max_body_size {largest};" in compose()["configs"]["balancer"]["content"]
    (ingress,) = of_kind("Ingress")
    assert ingress["metadata"]["annotations"]["nginx.ingress.kubernetes.io/proxy-body-size"] == largest


def test_the_image_gets_what_is_installed_and_no_more() -> None:
    """All is left out but what the packages and their notices need."""
    lines = [line for line in (ROOT / ".dockerignore").read_text().splitlines() if line and not line.startswith("#")]
    assert lines[0] == "*"
    kept = {line.removeprefix("!") for line in lines if line.startswith("!")}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    packages = {one.removesuffix("*") for one in project["tool"]["setuptools"]["packages"]["find"]["include"]}
    assert kept == {"pyproject.toml", project["project"]["readme"], *project["project"]["license-files"], *packages}
    left_out = {line.replace("/", ".") for line in lines if "/" in line} - {"**.__pycache__"}
    assert left_out <= {one.removesuffix("*") for one in project["tool"]["setuptools"]["packages"]["find"]["exclude"]}


def test_every_setting_is_a_flag_but_secrets() -> None:
    command = app.parse_commands(["serve"])[1][-1]
    flags = {name.removeprefix("--").replace("-", "_") for name in option_names(command)}
    secrets = {"webhook_secret", "sign_password"}
    assert flags >= NAMES - secrets
    assert not flags & secrets


def test_every_setting_is_documented() -> None:
    """The table of docs/deploy.md has a row for each setting with its default and meaning."""
    page = (DOCS / "deploy.md").read_text(encoding="utf-8")
    missing = [row for row in map(table_row, fields(ServiceSettings)) if row not in page]
    assert missing == [], "rows that docs/deploy.md lacks:\n" + "\n".join(missing)


def table_row(one: Any) -> str:
    """Row of a setting."""
    default = one.default
    if default is None or default in ((), ""):
        shown = ""
    elif isinstance(default, bool):
        shown = str(default).lower()
    else:
        shown = f"{default:g}" if isinstance(default, float) else str(default)
    return f"| `{one.name}` | {shown} | {one.metadata['help']} |"


def test_every_test_that_the_security_page_names_exists() -> None:
    rows = [line for line in (DOCS / "security.md").read_text(encoding="utf-8").splitlines() if "`test_" in line]
    assert len(rows) > 20
    sources = "\n".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py"))
    defined = set(re.findall(r"^def (test_\w+)\(", sources, re.MULTILINE))
    named = {name for row in rows for name in re.findall(r"`(test_\w+)`", row)}
    assert named <= defined, sorted(named - defined)
