"""Work shared among processes."""

import math
import time
from functools import partial

from corpus_tools.parallel import map_unordered


def test_every_task_is_returned_with_its_result() -> None:
    done = map_unordered([4.0, 9.0, 16.0], partial, (math.sqrt,), 2)
    assert sorted(done) == [(4.0, 2.0), (9.0, 3.0), (16.0, 4.0)]


def test_a_caller_that_stops_early_waits_for_no_task() -> None:
    done = map_unordered([0.0, 600.0, 600.0], partial, (time.sleep,), 2)
    assert next(done) == (0.0, None)
    began = time.monotonic()
    done.close()
    assert time.monotonic() - began < 60.0
