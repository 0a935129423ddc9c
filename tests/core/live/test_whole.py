"""An edit of all of the window that is spread over the readings which come meanwhile."""

from __future__ import annotations

import copy
import math
import threading
from functools import partial

import numpy as np
import pytest

from ftproc.core import pacing
from ftproc.core.editing import two_pass
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


def test_a_copy_goes_on_where_it_was_made():
    """Whatever its twin does meanwhile."""
    one = 100.0 + PASS
    whole = Whole(sweeping(*[100] * 8), 100)
    assert not whole.go_on(3 * one)
    copied = copy.deepcopy(whole)
    turns = [whole.go_on(one) for _ in range(6)]
    assert turns[3:] == [False, True, True]
    assert [copied.go_on(one) for _ in range(6)] == turns
    assert copied.samples.tolist() == whole.samples.tolist()


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
