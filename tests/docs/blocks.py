"""Examples of the documentation: fenced blocks, and command lines in them."""

import re
import shlex
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = (*(ROOT / f"{name}.md" for name in ("README", "CONTRIBUTING", "SECURITY")), *sorted(DOCS.rglob("*.md")))
README, CLI_PAGE = ROOT / "README.md", DOCS / "cli.md"
EXECUTED_PAGES = (README, CLI_PAGE)
PERSON, WINDOW, LONG = "needs video of a person", "opens a window", "takes over a minute"
NOT_EXECUTED = {  # beginning of a command line: why it is parsed only
    '"Hello." --view': WINDOW,
    '"Hello." --talker me.talker --face self': PERSON,
    "mimic take.mp4": PERSON,
    "mimic --camera": WINDOW,
    "worker": "runs until it is interrupted",
    "serve --port": "runs until it is interrupted",
    "live": "sends to a receiver; tests/targets/test_live_command.py runs the command",
    "keys list": "needs a file of keys",
    "keys remove": "needs a file of keys",
    "jobs show": "needs the name of a job",
    "jobs prune --store": "needs a finished batch",
    "corpus setup": "uses the network",
    "voices add": "uses the network; tests/sound/test_hibari_voices.py runs the command",
    "voices remove": "needs a voice that was added",
    "corpus build": PERSON,
    "corpus check": PERSON,
    "corpus face": PERSON,
    "corpus gestures": PERSON,
    "report retarget": PERSON,
    "corpus audio-maps": "needs 20 or more recordings",
    "corpus evaluate --talker": "needs landmark tracks; tests/corpus_tools/build/test_people.py runs the command",
    "corpus evaluate --people": "needs their sounds, too; tests/corpus_tools/build/test_heard.py runs the command",
    "corpus pool": "needs lip tracks; tests/corpus_tools/build/test_pooling.py runs the command",
    "corpus evaluate": PERSON,
    "report gestures": LONG,
}
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


def reason_not_executed(line: str) -> str | None:
    """Why a command line is not executed."""
    command = line.partition("tts2face ")[2]
    return next((reason for start, reason in NOT_EXECUTED.items() if command.startswith(start)), None)


def lines_that_need_a_person() -> list[str]:
    """Command lines that need video of a person, without their comments."""
    lines = [line for page in EXECUTED_PAGES for line in shell_lines(page)]
    return [line.split("  #")[0].strip() for line in lines if reason_not_executed(line) == PERSON]
