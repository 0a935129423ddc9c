"""A look at all of the window that is spread over the readings which come meanwhile."""

from __future__ import annotations

import math
import threading
from functools import partial

import numpy as np
import pytest

from ftproc.core import pacing
from ftproc.core.editing import two_pass
from ftproc.core.live import pace
from ftproc.core.live.whole import Whole
from ftproc.core.pacing import PASS
from ftproc.methods import live
from ftproc.settings import FilterSettings
from tests.simulated import simulate

pytestmark = pytest.mark.compiled

UNKNOWN = two_pass.Known(np.full(3, np.nan), None, 4.0)


def sweeping(*samples):
    """Work of sweeps over so many samples, each."""

    def work():
        for count in samples:
            pacing.swept(count)
        return "edited"

    return work


@pytest.fixture(scope="module")
def flight():
    return simulate("manoeuvre", seed=3, duration_s=8.0, dt_s=0.04, outliers="isolated=0.05:6-300,offset=1:8-20:20-200")


def test_a_little_at_a_time_it_finds_the_same(flight):
    t, z = flight.log.time_s, flight.log.measurement
    at_once = two_pass.edit(t, z, UNKNOWN, live=True)
    whole, turns = Whole(partial(two_pass.edit, t, z, UNKNOWN, live=True), len(t)), 0
    while not whole.go_on(3.0 * (len(t) + PASS)):
        turns += 1
    np.testing.assert_array_equal(whole.found.weight, at_once.weight)
    np.testing.assert_array_equal(whole.found.smoothed().state, at_once.smoothed().state)
    assert turns > 8
    assert whole.go_on(0.0)


def test_what_a_turn_takes_too_much_is_taken_from_the_next():
    one = 100.0 + PASS
    whole = Whole(sweeping(int(5 * one) - PASS, 100, 100, 100), 100)
    taken = [whole.go_on(one) for _ in range(9)]
    assert taken == [False] * 7 + [True, True]  # of eight
    assert whole.found == "edited"


def test_a_row_that_comes_in_between_moves_those_after_it():
    whole = Whole(sweeping(1, 1, 1), 5)
    whole.make_room(3)
    assert whole.samples.tolist() == [0, 1, 2, 4, 5]


def test_no_turn_does_much_more_than_its_share(flight, monkeypatch):
    """However long a look lasts, the passes between two readings are bounded, but for tracks in doubt."""
    taken = []
    go_on = Whole.go_on

    def counted(self, samples):
        before = self._work.credit
        done = go_on(self, samples)
        if math.isfinite(samples):
            taken.append((before + samples - self._work.credit, samples, len(self.samples) + PASS))
        return done

    monkeypatch.setattr(Whole, "go_on", counted)
    editor = live.editor(FilterSettings(editing="live"))
    editor.push(flight.log.time_s, flight.log.measurement)
    assert len(taken) > 5
    assert all(spent <= share + 4 * a_pass for spent, share, a_pass in taken)
    assert any(spent < share for spent, share, _ in taken)


def test_a_late_row_may_come_while_it_lasts(flight, monkeypatch):
    monkeypatch.setattr(pace, "WORK_PER_S", 2e4)  # so that it lasts
    t, z = flight.log.time_s, flight.log.measurement
    editor = live.editor(FilterSettings(editing="live", lag_s=1.0))
    found, taken, late = [], [], 0
    for k in range(0, len(t) - 2, 3):
        found += editor.push(t[[k, k + 2]], z[[k, k + 2]])
        taken += [k, k + 2]
        if editor.insert(float(t[k + 1]), z[[k + 1]]):
            taken.append(k + 1)
            late += editor.window is not None and editor.window.under_way is not None
    assert late > 20
    state = np.concatenate([each.rows["state"] for each in found])
    there = np.isfinite(state[:, 0])
    truth = flight.truth.position_m[sorted(taken)][: len(state)]
    off = np.linalg.norm(state[there, :3] - truth[there], axis=1)
    assert there[40:].all()
    assert np.median(off) < 5.0


def test_errors_are_those_of_the_work():
    def failing():
        pacing.swept(10)
        pacing.swept(10)
        raise ValueError("no reading agrees")

    whole = Whole(failing, 10)
    assert not whole.go_on(1.0)
    with pytest.raises(ValueError, match="no reading agrees"):
        whole.go_on(1000.0)


def test_work_that_nobody_wants_ends_its_thread():
    before = threading.active_count()
    whole = Whole(sweeping(*[100] * 1000), 10)
    assert not whole.go_on(1.0)
    assert threading.active_count() == before + 1
    thread = whole._thread
    del whole
    thread.join(5.0)
    assert not thread.is_alive()
