"""Extras and packages: each bears what the reasons of skipped tests say, and all of them are installed by test-all."""

import tomllib
from importlib.metadata import packages_distributions

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from tests.conftest import TESTS
from tests.packages import EXTRAS, OTHERS, missing, needs

PROJECT = tomllib.loads((TESTS.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
LISTED = PROJECT["optional-dependencies"]


def packages_of(extra: str) -> set[str]:
    """Packages that an extra lists, with those of the extras that it includes."""
    listed = [Requirement(line) for line in LISTED[extra]]
    included = [packages_of(name) for one in listed if one.name == PROJECT["name"] for name in one.extras]
    return {canonicalize_name(one.name) for one in listed if one.name != PROJECT["name"]}.union(*included)


def test_all_extras_of_the_product_are_tested() -> None:
    assert set().union(*map(packages_of, LISTED.keys() - {"docs"})) == packages_of(OTHERS)
    assert packages_of("test") < packages_of(OTHERS)


def test_a_reason_names_the_extra_that_brings_the_package() -> None:
    providers = packages_distributions()
    assert set(EXTRAS.values()) <= set(LISTED)
    installed = {module: extra for module, extra in EXTRAS.items() if missing(module) is None}
    assert {"cv2", "dbos", "fastapi", "nicegui"} <= set(installed)
    for module, extra in installed.items():
        packages = {canonicalize_name(name) for name in providers[module.partition(".")[0]]}
        assert packages & packages_of(extra), module


def test_a_missing_package_skips_with_the_command_that_installs_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.packages.find_spec", lambda name: None if name == "pxr" else object())
    assert missing("numpy", "av") is None
    with pytest.raises(pytest.skip.Exception, match=r"needs pxr.Usd: pip install 'tts2face\[usd\]'"):
        needs("numpy", "pxr.Usd")
