"""How often a window is edited: by the interval of its readings, and by a clock that goes on."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ftproc.core.live.pace import SELDOM, SHORTEST_S, STANDING, TICK_S, Clock, pace_of
from ftproc.core.live.pieces import CROWD

FLOOD = {
    "one time": np.full(5000, 3.0),
    "few times": np.repeat(np.arange(5.0), 1000),
    "no time": 3.0 + 1e-12 * np.arange(5000),
    "pairs": np.repeat(0.1 * np.arange(500), 2),
    "even": 0.05 * np.arange(500),
}


@pytest.mark.parametrize("interval_s", [10.0, 0.1, 1e-3])
def test_the_pace_is_that_of_the_typical_interval(interval_s):
    times = interval_s * np.arange(400.0)
    found = pace_of(times, 0.0)
    assert found.longest_s == pytest.approx(20 * interval_s)
    assert found.refresh == max(1, round(0.1 / interval_s))
    gap = times + 1e9 * (np.arange(400) > 200)
    twice = np.sort(np.concatenate([times, times, times + 1e-9]))
    for other in (gap, twice):
        assert pace_of(other, 0.0).sizes == found.sizes


@pytest.mark.parametrize("times", [np.empty(0), np.zeros(1), np.zeros(50), 5e-324 * np.arange(50), 1e10 * np.arange(9)])
@pytest.mark.parametrize("lag_s", [0.0, 2.0, 3600.0])
def test_every_pace_is_finite_and_bounded(times, lag_s):
    found = pace_of(times, lag_s)
    assert found.sizes.window >= 2 * found.sizes.near
    assert found.sizes.most_waiting <= 250_000
    assert found.refresh >= 1
    assert found.turn >= 1
    assert np.isfinite([found.work, found.longest_s]).all()


def test_few_long_intervals_among_many_short_ones_do_not_count():
    assert pace_of(np.cumsum(np.r_[0.1, np.full(SELDOM - 1, 1e-6)]), 0.0).longest_s == pytest.approx(20 * SHORTEST_S)
    assert pace_of(np.cumsum(np.r_[0, 0.1, np.full(SELDOM - 1, 1e-6)]), 0.0).longest_s == pytest.approx(2.0)


@pytest.mark.parametrize("step", [1, 7, 999, 10_000])
@pytest.mark.parametrize("name", FLOOD)
def test_turns_do_not_depend_on_how_rows_come(name, step):
    """A turn is due with every row; which rows get one is counted."""
    time_s = FLOOD[name]
    clock, turns = Clock(), []
    for low in range(0, len(time_s), step):
        block = time_s[low : low + step]
        done = 0
        while done < len(block):
            count = clock.rows_to_turn(block[done:], 1, math.inf, math.inf)
            clock, done = clock.after(block[done : done + count]), done + count
            if not clock.stands or clock.rows % CROWD == 0:
                turns.append(low + done - 1)
    ticks = time_s // TICK_S
    order = np.arange(len(ticks)) - np.searchsorted(ticks, ticks) + 1
    assert turns == np.flatnonzero((order <= STANDING) | (order % CROWD == 0)).tolist()
