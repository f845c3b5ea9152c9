"""One version everywhere, and what `.ci/release` does before and after it builds."""

import re
import subprocess
from importlib.machinery import SourceFileLoader
from importlib.metadata import PathDistribution
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path
from types import ModuleType

import pytest
import yaml

from tests.docs.blocks import ROOT
from tts2face import __version__

CHANGELOG = "# Changelog\n\nAbout.\n\n## 0.2.0\n\n- New.\n- Newer.\n\n## 0.1.0 (2025)\n\n- Old.\n\n## 0.0.1\n"


@pytest.fixture(scope="module")
def script() -> ModuleType:
    """The script, as a module."""
    loader = SourceFileLoader("release", str(ROOT / ".ci/release"))
    spec = spec_from_loader(loader.name, loader)
    assert spec is not None
    module = module_from_spec(spec)
    loader.exec_module(module)
    return module


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A committed package of version 0.2.0 whose changelog has it."""
    root = tmp_path / "repository"
    (root / "tts2face").mkdir(parents=True)
    (root / "tts2face/__init__.py").write_text('"""A package."""\n\n__version__ = "0.2.0"\n')
    (root / "CHANGELOG.md").write_text(CHANGELOG)
    subprocess.run(["git", "init", "--quiet", root], check=True)
    commit_all(root)
    return root


def commit_all(root: Path) -> None:
    subprocess.run(["git", "-C", root, "add", "."], check=True)
    author = ("-c", "user.name=a", "-c", "user.email=a@b.example")
    subprocess.run(["git", "-C", root, *author, "commit", "--quiet", "--message", "All"], check=True)


def test_the_version_is_the_same_everywhere(script: ModuleType) -> None:
    assert script.read_version(ROOT) == __version__
    assert script.changelog_section((ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), __version__).startswith("- ")
    assert yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["version"] == __version__


def test_the_citation_names_what_the_format_demands() -> None:
    cited = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert cited["cff-version"] == "1.2.0"
    assert {"message", "title", "authors"} <= cited.keys()
    assert cited["license"] in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    papers = [(one["authors"][0]["family-names"], one["year"]) for one in cited["references"]]
    assert papers == [("Theobald", 2007), ("Ju", 2008)]
    architecture = (ROOT / "docs/architecture.md").read_text(encoding="utf-8").lower()
    assert all(f"*{one['title'].lower()}*" in architecture for one in cited["references"])


def test_commits_and_ci_run_the_same_linters() -> None:
    (local,) = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text(encoding="utf-8"))["repos"]
    linter = re.compile(r"^(?:nice )?((?:ruff|mypy|lint-imports)\b[^>\n]*?)(?: >.*)?$", re.MULTILINE)
    run = set(linter.findall((ROOT / ".ci/run").read_text(encoding="utf-8")))
    assert {hook["entry"] for hook in local["hooks"]} == run
    assert len(run) == 4


def test_releases_begin_only_with_a_committed_and_described_version(
    script: ModuleType, repository: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    built: list[Path] = []

    def build(root: Path, *_: Path) -> Path:
        built.append(root)
        raise SystemExit("built")

    monkeypatch.setattr(script, "build", build)
    out = tmp_path / "out"
    with pytest.raises(SystemExit, match="built"):
        script.main([str(out)], repository)
    assert built == [repository]
    with pytest.raises(SystemExit, match=r"release: \S+/repository exists; remove it or name another folder"):
        script.main([str(repository)], repository)
    (repository / "tts2face/__init__.py").write_text('__version__ = "0.3.0"\n')
    with pytest.raises(SystemExit, match=r"release: 1 paths are not committed \(tts2face/__init__\.py\)"):
        script.main([str(out)], repository)
    commit_all(repository)
    with pytest.raises(SystemExit, match=r"says nothing about 0\.3\.0; add a section ## 0\.3\.0"):
        script.main([str(out)], repository)
    assert len(built) == 1
    assert not out.exists()


def test_unknown_arguments_are_refused(script: ModuleType, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit, match="2"):
        script.main(["--version", "0.2.0"])
    assert "usage: .ci/release" in capsys.readouterr().err


def test_the_section_of_a_version_is_cut(script: ModuleType) -> None:
    assert script.changelog_section(CHANGELOG, "0.2.0") == "- New.\n- Newer.\n"
    assert script.changelog_section(CHANGELOG, "0.1.0") == "- Old.\n"
    for version in ("0.0.1", "0.2"):
        with pytest.raises(SystemExit, match=f"says nothing about {version};"):
            script.changelog_section(CHANGELOG, version)


def test_a_failed_step_says_its_last_line(script: ModuleType) -> None:
    with pytest.raises(SystemExit, match=r"release: git -C /no .* failed: fatal: cannot change to '/no'"):
        script.run("git", "-C", "/no", "status")


def test_dependencies_are_listed_with_the_licences_that_they_state(script: ModuleType, tmp_path: Path) -> None:
    stated = {
        "b": "License-Expression: MIT\nClassifier: License :: OSI Approved :: BSD License\n",
        "a": "License: as below\n",
        "c": "Classifier: License :: OSI Approved :: BSD License\nLicense: long\n",
        "tts2face": "License-Expression: GPL-3.0-or-later\n",
        "d": "",
    }
    for name, lines in stated.items():
        (tmp_path / f"{name}.dist-info").mkdir()
        (tmp_path / f"{name}.dist-info/METADATA").write_text(
            f"Metadata-Version: 2.4\nName: {name}\nVersion: 1\n{lines}"
        )
    table = script.dependency_table(PathDistribution(tmp_path / f"{name}.dist-info") for name in stated)
    rows = ["name version licence", "a 1 as below", "b 1 MIT", "c 1 BSD License", "d 1 not stated"]
    assert [" ".join(line.split("\t")) for line in table.splitlines()] == rows
