"""Examples as they stand in the documentation: fenced blocks, and command lines in them."""

import re
import shlex
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = (ROOT / "README.md", *sorted(DOCS.rglob("*.md")))
_FENCED = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
_INDENTED = re.compile(r"^    (\S.*)$", re.MULTILINE)


def code_blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a page in a language, in their order."""
    found = _FENCED.findall(page.read_text(encoding="utf-8"))
    return [content for name, content in found if name == language]


def shell_lines(page: Path) -> list[str]:
    """Command lines of a page: of ``sh`` blocks, and indented ones of pages that have no fences."""
    lines = [line for block in code_blocks(page, "sh") for line in block.splitlines()]
    text = page.read_text(encoding="utf-8")
    return lines + (_INDENTED.findall(text) if "```" not in text else [])


def commands(line: str) -> list[list[str]]:
    """The words of each command of a line, split at ``&&`` and ``|`` and without its comment."""
    lexer = shlex.shlex(line, posix=True, punctuation_chars="&|")
    lexer.whitespace_split = True
    return [list(words) for is_joint, words in groupby(lexer, lambda word: word in {"&&", "|"}) if not is_joint]


def own_commands(line: str) -> list[list[str]]:
    """Arguments of each call of tts2face in a line."""
    return [words[1:] for words in commands(line) if words[0] == "tts2face"]
