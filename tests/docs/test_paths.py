"""Files and modules that the documentation names exist."""

import re
from pathlib import Path

import pytest

from tests.docs.blocks import PAGES, ROOT

PACKAGES = "tts2face|corpus_tools|lexicon|cli|tests|docs"
PATH = re.compile(rf"(?<![\w./-])((?:{PACKAGES})/[\w./-]*\.(?:py|tsv|csv|json|md|talker|face|palette))\b")
SHORT_PATH = re.compile(r"`((?:[a-z_0-9]+/)*[a-z_0-9]+\.(?:py|tsv))`")
MODULE = re.compile(rf"`((?:{PACKAGES})(?:\.[a-z_0-9]+)+)\b")
FILES = {
    path.relative_to(ROOT).as_posix()
    for package in PACKAGES.split("|")
    for path in (ROOT / package).rglob("*")
    if "__pycache__" not in path.parts
}
MODULES = {re.sub(r"(/__init__)?\.py$", "", path).replace("/", ".") for path in FILES} | {
    path.replace("/", ".") for path in FILES
}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.relative_to(ROOT).as_posix())
def test_named_files_and_modules_exist(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    missing = [path for path in PATH.findall(text) if path not in FILES]
    missing += [
        path for path in SHORT_PATH.findall(text) if not any(f"/{known}".endswith(f"/{path}") for known in FILES)
    ]
    missing += [name for name in MODULE.findall(text) if not {name, name.rpartition(".")[0]} & MODULES]
    assert not missing


def test_fifteen_sentences_of_the_papers_have_their_module() -> None:
    page = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")
    rows = re.findall(
        r'^\| "(.+?)" \| (?:T07|JL08) §[^|]+\| (.+) \|$', page.partition("## Where the papers live")[2], re.M
    )
    assert len(rows) >= 15
    assert all(PATH.search(modules) or re.search(r"`(tts2face|corpus_tools)/\w+/`", modules) for _, modules in rows)
