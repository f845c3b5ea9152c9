"""Shared fixtures: takes rendered by the project, and the folder of real recordings, which are not part of it."""

import os

os.environ.setdefault("SOURCE_DATE_EPOCH", "1796000000")  # the day in files: equal runs give equal bytes
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # the processes of a run share the cores; numpy reads it when loaded

import gc
from collections import Counter, OrderedDict
from collections.abc import Iterator
from hashlib import blake2b
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from tests.packages import needs
from tts2face.numeric.kernels import CACHE_VARIABLE, FOLDER

os.environ.setdefault(CACHE_VARIABLE, str(FOLDER))  # processes with another home compile nothing again

if TYPE_CHECKING:
    from tests.world import World
    from tts2face.session.session import Session
    from tts2face.sound.voice_pool import VoicePool

pytest_plugins = ["tests.started", "tests.running", "tests.divided_work"]

TESTS = Path(__file__).resolve().parent
GROUPS = {  # name of a folder and of a marker: what the tests in it do
    "server": "start servers, workers, databases or their processes",
    "browser": "drive a browser",
    "build": "make talkers, faces, styles or films, and look at every shipped person",
    "commands": "run command lines and examples of the documentation, or the package in processes of their own",
    "fuzz": "try many generated or hostile inputs",
}
NIGHTLY = "nightly"  # marker of tests that take minutes, of which others do a little; they are in no other group
DEFAULT = f"smoke or not ({' or '.join((*GROUPS, NIGHTLY))})"  # as in pyproject.toml
SHARED_SERVER = "host"  # fixture
SMOKE = ("smoke", "tests.face.people")  # in the text of a module with tests that run by default in a folder of a group
LONGEST_NAME = 200  # characters of a value in the name of a test
SENTENCES_HEARD = 64
SKIPPED = "tts2face/skipped"  # in pytest's cache
SHARED = Path(os.environ.get("TTS2FACE_SHARED", Path(__file__).resolve().parents[2] / "shared"))


@pytest.fixture(scope="session")
def shared_recordings() -> Path:
    """Folder of real recordings, next to the project or in TTS2FACE_SHARED."""
    folder = SHARED / "recordings"
    if not folder.is_dir():
        pytest.skip("figures about real people: their recordings are not part of the project (TTS2FACE_SHARED)")
    return folder


@pytest.fixture(scope="session")
def rendered_takes() -> Path:
    """Videos of a speaking head with transcripts and word times, to read only; see `tests.rendered_takes`."""
    return TESTS / "takes"


@pytest.fixture(scope="session")
def rendered_capture() -> Path:
    """A Live Link Face capture of a speaking face, to read only; its sound is in the same folder."""
    return TESTS / "takes" / "take.csv"


@pytest.fixture(scope="session")
def voices() -> "VoicePool":
    """Loaded voices that the sessions of a process share."""
    from tts2face.sound.voice_pool import VoicePool

    return VoicePool()


@pytest.fixture(scope="session")
def shipped(voices: "VoicePool") -> "Session":
    """A session of the shipped talker, palette and voices on the head."""
    from tts2face.session.session import Session

    return Session("grid_s1", "head", voices=voices)


@pytest.fixture(scope="session")
def heard_once() -> Iterator[None]:
    """What the recogniser hears is kept by the content of the sound: the same sentences are heard by many tests."""
    from tts2face.sound.recogniser import PhoneRecogniser

    hear, kept = PhoneRecogniser._hear, OrderedDict()

    def recall(recogniser: PhoneRecogniser, samples: Any) -> Any:
        key = blake2b(samples.tobytes()).digest()
        if key not in kept:
            kept[key] = hear(recogniser, samples)
            while len(kept) > SENTENCES_HEARD:
                kept.popitem(last=False)
        return kept[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(PhoneRecogniser, "_hear", recall)
        yield


@pytest.fixture(scope="module")
def drafted() -> Iterator[None]:
    """Files are deflated as drafts, at a fifth of the time: for tests of what is in them, which are a little larger."""
    from tts2face.storage import deflated

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(deflated, "LEVEL", deflated.DRAFT_LEVEL)
        yield


@pytest.fixture(scope="session")
def world(tmp_path_factory: pytest.TempPathFactory) -> "World":
    """The small made world, see `tests.world`."""
    from tests.world import make_world

    return make_world(tmp_path_factory.mktemp("world"))


@pytest.fixture(scope="module")
def tones(world: "World") -> "Iterator[World]":
    """The made world, while this process has its voice."""
    from tests.world import voice_of_tones

    with voice_of_tones(world):
        yield world


@pytest.fixture(scope="session", params=["rendered", "real"])
def takes(request: pytest.FixtureRequest) -> Path:
    """Recordings in the layout of GRID: rendered ones, and real ones if available."""
    if request.param == "rendered":
        return request.getfixturevalue("rendered_takes")
    return request.getfixturevalue("shared_recordings") / "grid_s1"


@pytest.fixture(scope="session", params=["rendered", "real"])
def capture(request: pytest.FixtureRequest) -> Path:
    """A Live Link Face capture with its sound in the same folder: a rendered one, and a real one if available."""
    if request.param == "rendered":
        return request.getfixturevalue("rendered_capture")
    return request.getfixturevalue("shared_recordings") / "livelink" / "testset_arkit61_60fps.csv"


@pytest.fixture(scope="session")
def face_model() -> Path:
    """Bundle of landmark models."""
    needs("ai_edge_litert", "cv2")
    from lexicon.errors import BackendError
    from tts2face.video.networks import find_bundle

    try:
        return find_bundle()
    except BackendError as missing:
        pytest.skip(str(missing))


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Register the markers of the slow groups; tests that are named by their path run whatever group they are in."""
    for name, content in GROUPS.items():
        config.addinivalue_line(
            "markers", f"{name}: tests in folders of this name, and long ones beside them: {content}"
        )
    config.addinivalue_line("markers", "formats: other programs read files of the product, or write what it reads")
    config.addinivalue_line("markers", "smoke: one test of a promise; it runs by default though its folder does not")
    config.addinivalue_line(
        "markers", f"{NIGHTLY}: soaks and all cases of what others try in examples; in no other group"
    )
    config.addinivalue_line(
        "markers", "skipped: tests that the last run has skipped, for a machine that has now what they need"
    )
    config.addinivalue_line("markers", "needs(*modules): tests that import these modules (tests/packages.py)")
    if config.args_source == pytest.Config.ArgsSource.ARGS and config.option.markexpr == DEFAULT:
        config.option.markexpr = ""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Leave modules out whose tests the default run would only deselect: reading a fourth of all costs seconds."""
    return True if config.option.markexpr == DEFAULT and not may_run_by_default(collection_path) else None


def may_run_by_default(path: Path) -> bool:
    """Whether a module of tests is in no folder of a group, or names what runs by default all the same."""
    if path.suffix != ".py" or GROUPS.keys().isdisjoint(path.relative_to(TESTS).parts[:-1]):
        return True
    text = path.read_text(encoding="utf-8")
    return any(one in text for one in SMOKE)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark tests by their folders, and sort them: those of a shared server first, files of the default run last.

    Tests that share a server belong to one group of pytest-xdist, so that a run starts that server once.
    """
    cache = getattr(config, "cache", None)  # absent with `-p no:cacheprovider`
    skipped = set(cache.get(SKIPPED, [])) if cache else set()
    for item in items:
        if not skipped.isdisjoint((item.nodeid, item.nodeid.partition("::")[0])):  # the test, or its whole file
            item.add_marker("skipped")
        folders = item.path.relative_to(TESTS).parts[:-1]
        is_nightly = item.get_closest_marker(NIGHTLY) is not None
        for name in GROUPS.keys() & set(folders) if not is_nightly else ():
            item.add_marker(name)
        if SHARED_SERVER in getattr(item, "fixturenames", ()):
            is_apart = "browser" in folders and not item.get_closest_marker("smoke")
            item.add_marker(pytest.mark.xdist_group("browser" if is_apart else SHARED_SERVER))
    items.sort(key=lambda item: (item.get_closest_marker("xdist_group") is None, not _groups(item)))


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip tests that are marked as needing modules which are not installed."""
    for marker in item.iter_markers("needs"):
        needs(*marker.args)


def pytest_make_parametrize_id(val: object, argname: str) -> str | None:
    """Short names of long values: a name stands in an environment variable of each child process.

    They do not depend on the value, which may be another one in each process: an encoder's output, say.
    """
    return argname if isinstance(val, str | bytes) and len(val) > LONGEST_NAME else None


def pytest_collection_finish() -> None:
    """Keep Python's collector from looking through all tests again and again."""
    gc.collect()
    gc.freeze()


def _groups(item: pytest.Item) -> set[str]:
    return {*GROUPS, NIGHTLY} & {marker.name for marker in item.iter_markers()}


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> Any:
    """The tests of a group of pytest-xdist run in one process, and those of a file that are in none."""
    from xdist.scheduler import LoadGroupScheduling

    class Scheduler(LoadGroupScheduling):
        def _split_scope(self, nodeid: str) -> str:
            return super()._split_scope(nodeid).split("::")[0]

    return Scheduler(config, log)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name what was skipped and why, one line for each reason."""
    skipped = terminalreporter.stats.get("skipped", [])
    if cache := getattr(terminalreporter.config, "cache", None):
        cache.set(SKIPPED, sorted(report.nodeid for report in skipped))
    reasons = Counter(str(report.longrepr[2]) for report in skipped)
    if reasons:
        terminalreporter.section("skipped tests")
    for reason, number in reasons.most_common():
        terminalreporter.write_line(f"{number:4d}  {reason.removeprefix('Skipped: ')}")
