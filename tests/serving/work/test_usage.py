"""Limits of keys over all servers of a database: two servers' limits on one table, with a clock for each."""

import asyncio
from collections.abc import Iterator
from typing import Any

import pytest

from tests.packages import reason

pytest.importorskip("dbos", reason=reason("dbos"))

from tts2face.serving.service.access import RateLimits
from tts2face.serving.service.errors import RefusedError
from tts2face.serving.service.keys import ApiKey
from tts2face.serving.work import usage
from tts2face.serving.work.database import database_url
from tts2face.serving.work.usage import SharedUsage, Spent, UsageTable
from tts2face.storage.sql import Database, DatabaseAwayError

FIVE = ApiKey("a", "", requests_per_minute=5, concurrent=3, speech_s_per_day=100)


class Server:
    """Limits of one server, whose loop is called by the test.

    Parameters
    ----------
    url
        Database that it shares.
    name
        Of the server.
    """

    def __init__(self, url: str, name: str) -> None:
        self.database, self.name, self.now = Database(url), name, 0.0
        self.table, self.limits = UsageTable(self.database), RateLimits(lambda: self.now)

    def n_allowed(self, n: int, key: ApiKey = FIVE) -> int:
        """How many of so many requests, one after another, are not refused."""
        allowed = 0
        for _ in range(n):
            try:
                self.limits.begin(key)
            except RefusedError:
                continue
            self.limits.end(key)
            allowed += 1
        return allowed

    def share(self) -> None:
        async def exchange(*used: Any) -> SharedUsage:
            return self.table.exchange(self.name, *used)

        asyncio.run(self.limits.share(exchange))


@pytest.fixture
def servers(database: str) -> Iterator[tuple[Server, Server]]:
    url = database_url(database)
    made = Server(url, "one"), Server(url, "two")
    made[0].table.create()
    yield made
    for one in made:
        one.database.close()


def test_requests_a_minute_are_those_of_all_servers(servers: tuple[Server, Server]) -> None:
    one, two = servers
    assert one.n_allowed(3) == 3
    one.share()
    two.share()
    assert two.n_allowed(9) == 2
    two.share()
    one.share()
    assert (one.n_allowed(1), two.n_allowed(1)) == (0, 0)
    one.now = two.now = 24.5
    assert one.n_allowed(9) == 2  # a fifth comes back each 12 s


def test_what_is_used_between_two_exchanges_is_subtracted_afterwards(servers: tuple[Server, Server]) -> None:
    one, two = servers
    assert (one.n_allowed(9), two.n_allowed(9)) == (5, 5)
    for server in (one, two, one):
        server.share()
    one.now = two.now = 59.0
    assert (one.n_allowed(9), two.n_allowed(9)) == (0, 0)
    one.now = two.now = 75.0
    assert one.n_allowed(9) == 1


def test_what_runs_elsewhere_counts_while_its_server_is_alive(
    servers: tuple[Server, Server], monkeypatch: pytest.MonkeyPatch
) -> None:
    one, two = servers
    for _ in range(2):
        one.limits.begin(FIVE)
    one.share()
    two.share()
    two.limits.begin(FIVE)
    with pytest.raises(RefusedError, match="the key a has 3 requests running, its limit"):
        two.limits.begin(FIVE)
    one.limits.end(FIVE)
    one.limits.end(FIVE)
    one.share()
    two.share()
    two.limits.begin(FIVE)
    two.share()
    one.share()
    with pytest.raises(RefusedError, match="2 requests running"):
        one.limits.begin(ApiKey("a", "", concurrent=2))
    monkeypatch.setattr(usage, "RUNS_S", 0.0)  # the other server is dead
    one.share()
    one.limits.begin(ApiKey("a", "", concurrent=1))


def test_speech_of_the_day_is_shared_and_kept(servers: tuple[Server, Server]) -> None:
    """A server that starts again knows what was used."""
    one, two = servers
    one.limits.add_speech(FIVE, 130.0)
    one.share()
    two.share()
    with pytest.raises(RefusedError, match="100 seconds of speech a day"):
        two.limits.check_speech(FIVE)
    two.limits.check_speech(ApiKey("b", "", speech_s_per_day=100))


def test_a_clock_that_is_set_back_refuses_nobody(servers: tuple[Server, Server]) -> None:
    one, two = servers
    one.n_allowed(5)
    one.share()
    with one.database.transaction() as change:
        change.run("UPDATE tts2face_key_usage SET at = at + 3600")
    one.now = 30.0
    one.share()
    assert one.n_allowed(9) == 2
    one.share()  # its row has the time of the clock again
    two.share()
    assert two.n_allowed(9) == 0


def test_a_server_counts_alone_while_the_database_is_away() -> None:
    """What could not be shared is shared later."""
    limits, key, given = RateLimits(), ApiKey("a", "", requests_per_minute=5), []

    async def away(*_: object) -> SharedUsage:
        raise DatabaseAwayError("away")

    async def exchange(spent: list[Spent], _: object) -> SharedUsage:
        given.extend(spent)
        return SharedUsage()

    limits.count(key)
    with pytest.raises(DatabaseAwayError):
        asyncio.run(limits.share(away))
    limits.count(key)
    asyncio.run(limits.share(exchange))
    assert [one.amount for one in given] == [2.0]
