"""Rights and quotas of keys: scopes, seconds of speech a day, turns of the queues, and the comparison of hashes."""

import asyncio
import hmac
from collections import Counter
from collections.abc import AsyncIterator, Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from cli.main import run
from lexicon.errors import DataError, InputError
from tts2face.processes.message import EVENT, Message
from tts2face.serving.service.access import RateLimits
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import LOCAL_KEY, ApiKey, add_key, find_key, read_keys, remove_key
from tts2face.serving.service.messages import BusyError, Work
from tts2face.serving.service.pool import (
    LIVE_COST,
    MOST_BEGUN_BY_SHARE,
    MOVIE_COST,
    PLACES,
    SOUND_COST,
    Place,
    Places,
    Pool,
    PoolSettings,
)
from tts2face.serving.service.results import Results
from tts2face.serving.service.settings import ServiceSettings
from tts2face.serving.service.state import ServiceState

HOUR_S = 3600.0
N_MOST = round(MOST_BEGUN_BY_SHARE * PLACES[MOVIE_COST])  # movies that may have begun


class Clock:
    """Seconds that a test sets."""

    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


def test_seconds_of_speech_a_day_are_limited() -> None:
    """A day's seconds may be used at once; they come back evenly, also what was used beyond them."""
    clock = Clock()
    limits, key = RateLimits(clock), ApiKey("a", "", speech_s_per_day=240)
    other = replace(key, name="b")
    limits.check_speech(key)
    limits.add_speech(key, 239.0)
    limits.check_speech(key)
    limits.add_speech(key, 11.0)  # the last request may use more than is left
    with pytest.raises(RefusedError, match="the key a has used its 240 seconds of speech a day") as refused:
        limits.check_speech(key)
    assert (refused.value.status, refused.value.headers["Retry-After"]) == (429, str(int(1.1 * HOUR_S)))
    limits.check_speech(other)
    limits.check_speech(LOCAL_KEY)
    clock.now = 0.9 * HOUR_S
    with pytest.raises(RefusedError):
        limits.check_speech(key)
    clock.now = 1.1 * HOUR_S
    limits.check_speech(key)
    clock.now = 1000 * HOUR_S
    limits.add_speech(key, 240.0)  # no more than a day's seconds are kept
    with pytest.raises(RefusedError):
        limits.check_speech(key)


def test_photos_of_a_key_are_made_one_after_another_and_so_many_a_day() -> None:
    clock = Clock()
    limits, key = RateLimits(clock), ApiKey("a", "")
    with limits.photo(key, 2):
        with pytest.raises(RefusedError, match="a face of a photo of the key a is being made"), limits.photo(key, 2):
            pass
        with limits.photo(replace(key, name="b"), 2):
            pass
    with limits.photo(key, 2, counts=False), pytest.raises(RefusedError):
        limits.photo(key, 2).__enter__()
    with limits.photo(key, 2):
        pass
    with pytest.raises(RefusedError, match="the key a has used its 2 photos a day") as refused, limits.photo(key, 2):
        pass
    assert (refused.value.status, refused.value.headers["Retry-After"]) == (429, str(int(12 * HOUR_S)))
    clock.now = 12 * HOUR_S
    with limits.photo(key, 2):
        pass
    with limits.photo(replace(key, name="c", photos_per_day=10), 0):
        pass
    barred = replace(key, photos_per_day=0)
    with pytest.raises(RefusedError, match="may make no faces of photos"), limits.photo(barred, 2):
        pass


class OnePartPool:
    """A pool that makes 10 s of speech in a part, and then waits for ever."""

    async def stream(self, work: Work, key: str, *_: Any) -> AsyncIterator[Message]:
        yield Message(EVENT, {"seconds": 10.0}, b"abc")
        await asyncio.Event().wait()


def make_state() -> ServiceState:
    state = ServiceState(ServiceSettings(processes=1))
    pool: Any = OnePartPool()
    state.results = Results(state.settings, state.permissions, pool, state.metrics, None)
    return state


def first_part(state: ServiceState, key: ApiKey) -> None:
    """Begin a work and cancel it after its first part."""

    async def begin() -> None:
        messages = state.results.messages(state.results.work(request={"text": "Hello."}), key)
        await anext(messages)
        await messages.aclose()  # type: ignore[attr-defined]

    asyncio.run(begin())


def test_speech_of_cancelled_requests_counts() -> None:
    state, key = make_state(), ApiKey("a", "", speech_s_per_day=15)
    first_part(state, key)
    first_part(state, key)
    with pytest.raises(RefusedError, match="15 seconds of speech a day"):
        first_part(state, key)


def test_synthesis_needs_the_scope_speak() -> None:
    with pytest.raises(RefusedError, match="lacks the scope speak") as refused:
        first_part(make_state(), ApiKey("a", "", ("build", "admin")))
    assert refused.value.status == 403


def test_long_words_are_refused_before_any_work() -> None:
    state = make_state()

    async def begin() -> None:
        await anext(state.results.messages(state.results.work(request={"text": "1" * 201}), LOCAL_KEY))

    with pytest.raises(RefusedError, match="a word of more than 200 characters"):
        asyncio.run(begin())


class FakeProcess:
    """A process that is ready and works on some movies, by the letters of their keys."""

    def __init__(self, movies: str = "") -> None:
        self.is_ready, self.places = True, Places()
        for key in movies:
            self.places.take(MOVIE_COST, key, self)

    def n_movies(self) -> Counter[str]:
        """Number of movies of each key."""
        return Counter(place.key for place in self.places.of(MOVIE_COST))


def test_keys_take_turns() -> None:
    """A key that asks much more often waits for the others."""

    async def order() -> list[str]:
        pool = Pool(PoolSettings(n_processes=1))
        pool.processes = [FakeProcess("x" * (N_MOST - 1))]  # type: ignore[list-item]
        served: list[str] = []

        async def work(key: str) -> None:
            place = await pool._take(MOVIE_COST, key, "")
            served.append(key)
            await asyncio.sleep(0)
            pool._release(place)

        greedy = [asyncio.create_task(work("greedy")) for _ in range(6)]
        await asyncio.sleep(0)
        modest = [asyncio.create_task(work(key)) for key in ("modest", "modest", "rare")]
        await asyncio.gather(*greedy, *modest)
        assert len(pool.processes[0].places.begun) == N_MOST - 1
        return served

    served = asyncio.run(order())
    assert sorted(served) == ["greedy"] * 6 + ["modest"] * 2 + ["rare"]
    assert max(number for number, key in enumerate(served) if key != "greedy") <= 6


def waiting_keys(asked: str, n_places: int) -> tuple[list[str], list[str]]:
    """Keys whose works wait in the end, and those whose works were refused; of works that ask one after another.

    Parameters
    ----------
    asked
        A letter for each work: its key.
    """

    async def run() -> tuple[list[str], list[str]]:
        pool = Pool(PoolSettings(n_processes=1, max_waiting=n_places))
        pool.processes = [FakeProcess("x" * N_MOST)]  # type: ignore[list-item]
        refused: list[str] = []

        async def work(key: str) -> None:
            try:
                await pool._take(MOVIE_COST, key, "")
            except BusyError:
                refused.append(key)

        tasks = []
        for key in asked:
            tasks.append(asyncio.create_task(work(key)))
            await asyncio.sleep(0)
        await asyncio.sleep(0)
        found = [key for key, queue in pool._waiting.items() for _ in queue]
        assert pool.n_waiting == len(found)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        assert pool.n_waiting == 0
        return sorted(found), refused

    return asyncio.run(run())


@pytest.mark.parametrize(
    ("asked", "waiting", "refused"),
    [
        ("aaaaaaaaaa", "aaaaaaaa", "aa"),  # one key may have all places
        ("aaaaaaaab", "aaaaaaab", "a"),  # until another one needs one
        ("aaaaaaaabbbbbb", "aaaabbbb", "aaaabb"),  # and its share
        ("aaaaaaaabbbbcccc", "aaabbbcc", "aaaaabcc"),
        ("aaaaaaaabcdefgh", "abcdefgh", "aaaaaaa"),
        ("abcdefghi", "abcdefgh", "i"),  # no key has more than one
    ],
)
def test_keys_share_the_places_to_wait(asked: str, waiting: str, refused: str) -> None:
    """The newest works of the key that has most give way to a key that has fewer."""
    found, given_up = waiting_keys(asked, 8)
    assert ("".join(found), "".join(sorted(given_up))) == (waiting, "".join(sorted(refused)))


def test_short_works_do_not_wait_for_movies() -> None:
    async def run() -> list[str]:
        pool = Pool(PoolSettings(n_processes=1))
        pool.processes = [FakeProcess("a" * PLACES[MOVIE_COST])]  # type: ignore[list-item]
        served: list[str] = []

        async def work(name: str, cost: float) -> None:
            await pool._take(cost, "a", "")
            served.append(name)

        tasks = [asyncio.create_task(work(*one)) for one in (("movie", MOVIE_COST), ("sound", SOUND_COST))]
        await asyncio.sleep(0.01)
        assert served == ["sound"]
        pool._release(pool.processes[0].places.begun[0])
        await asyncio.gather(*tasks)
        assert pool.n_waiting == 0
        return served

    assert asyncio.run(run()) == ["sound", "movie"]


def begun_movies(asked: str, at_first: str, act: Callable[[Pool, list[Place]], None] = lambda *_: None) -> str:
    """Keys, by their letters, of the movies that have begun of those that are asked for one after another.

    Parameters
    ----------
    at_first
        Keys of those that one process has begun before.
    act
        Gets these places when all have asked.
    """

    async def run() -> str:
        pool = Pool(PoolSettings(n_processes=1))
        process = FakeProcess(at_first)
        pool.processes, places = [process], process.places.begun[:]  # type: ignore[list-item]
        tasks = []
        for key in asked:
            tasks.append(asyncio.create_task(pool._take(MOVIE_COST, key, "")))
            await asyncio.sleep(0)
        act(pool, places)
        for _ in range(4):
            await asyncio.sleep(0)
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        return "".join(sorted(process.n_movies().elements()))

    return asyncio.run(run())


@pytest.mark.parametrize(
    ("asked", "begun"),
    [
        ("a" * 20, "a" * 8),  # one key may have all places
        ("a" * 20 + "b" * 10, "a" * 8 + "b" * 4),  # another one has its share at once, and no more
        ("a" * 20 + "bcd", "a" * 8 + "bcd"),
        ("a" * 20 + "bcdef", "a" * 8 + "bcde"),  # up to a bound
    ],
)
def test_a_key_gets_its_share_of_the_running_places_at_once(asked: str, begun: str) -> None:
    assert begun_movies(asked, "") == begun


def test_a_place_that_is_free_goes_to_the_key_that_has_less() -> None:
    """The key with most has none again until it has less than its share."""

    def release(pool: Pool, places: list[Place]) -> None:
        for place in places[:3]:
            pool._release(place)

    assert begun_movies("a" * 9 + "b" * 9, "a" * 8, release) == "a" * 5 + "b" * 4


def test_a_work_that_waits_for_its_reader_holds_no_place() -> None:
    """So many clients that read slowly do not keep others of their key waiting."""

    def pause(pool: Pool, places: list[Place]) -> None:
        for place in places[:5]:
            pool._pause(place, True)

    assert begun_movies("a" * 5, "a" * 8, pause) == "a" * 10  # up to a bound of memory


def test_live_streams_hold_no_places_of_others() -> None:
    """Of streams that wait for a sentence, any number may be open."""

    async def run() -> int:
        pool = Pool(PoolSettings(n_processes=1))
        pool.processes = [FakeProcess()]  # type: ignore[list-item]
        taken = [await pool._take(LIVE_COST, "a", "") for _ in range(200)]
        taken += [await pool._take(cost, "a", "") for cost in PLACES]
        return len(taken)

    assert asyncio.run(run()) == 200 + len(PLACES)


def test_all_hashes_are_compared_in_constant_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By `hmac.compare_digest`, and also those after the right one."""
    compared: list[str] = []

    def compare(first: str, second: str) -> bool:
        compared.append(first)
        return original(first, second)

    original = hmac.compare_digest
    path = tmp_path / "keys.toml"
    secret = add_key(path, "a", ["speak"])
    add_key(path, "b", ["speak"])
    keys = read_keys(path)
    monkeypatch.setattr(hmac, "compare_digest", compare)
    found = find_key(keys, secret)
    assert found is not None
    assert found.name == "a"
    assert compared == [key.hash for key in keys]


def test_keys_are_listed_and_removed(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "keys.toml"
    command = ["keys", "add", "film", "--file", str(path), "--concurrent", "4", "--speech-s-per-day", "36000"]
    assert run(command) == 0
    add_key(path, "studio", ["speak", "admin"])
    capsys.readouterr()
    assert run(["keys", "list", "--file", str(path)]) == 0
    assert capsys.readouterr().out.splitlines() == [
        "film  speak  concurrent=4  speech_s_per_day=36000", "studio  speak,admin"
    ]  # fmt: skip
    assert run(["keys", "remove", "film", "--file", str(path)]) == 0
    assert [key.name for key in read_keys(path)] == ["studio"]
    with pytest.raises(InputError, match="has no key named film; its keys are studio"):
        remove_key(path, "film")


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("[[key]]\nname = 'a'\nhash = 'x'\nconcurrent = 0", "concurrent must be a whole number of at least 1, not 0"),
        ("[[key]]\nname = 'a'\nhash = 'x'\nspeech_s_per_day = 1.5", "speech_s_per_day must be a whole number"),
        ("[[key]]\nname = 'a'\nhash = 'x'\n[[key]]\nname = 'a'\nhash = 'y'", "names a key twice"),
        ("[[key]]\nname = 'a\"b'\nhash = 'x'", "a key's name consists of"),
        ("[[key]]\nname = 'a'\nhash = 1", "hash must be a text in quotes, not 1"),
        ("[[keys]]\nname = 'a'", "there is no 'keys' here; choose key"),
        ("key = 5", "key must be a list in square brackets, not 5"),
        ("[[key]]\nname = 'a'\nhash = 'x'\nscopes = ['fly']", "no scope 'fly'"),
    ],
)
def test_wrong_files_of_keys_are_refused(tmp_path: Path, content: str, reason: str) -> None:
    path = tmp_path / "keys.toml"
    path.write_text(content)
    with pytest.raises(DataError, match=reason):
        read_keys(path)


@pytest.mark.parametrize("name", ["", "a b", 'a"\n[[key]]', "x" * 65])
def test_names_of_keys_are_plain(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match="a key's name consists of"):
        add_key(tmp_path / "keys.toml", name, ["speak"])
