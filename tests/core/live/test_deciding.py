"""What else may hold is weighed as far as the readings leave time for it, and no further."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core import pacing
from ftproc.core.identification.scales import scales_of
from ftproc.core.live.newest import deciding, levels
from ftproc.core.live.newest.deciding import MOST_S, PER_S, Deciding
from tests.core.live.test_readmission import turning


@pytest.fixture
def asked(monkeypatch):
    """How many new samples it was weighed with, each time."""
    found = list[int]()
    hindsight = levels.hindsight
    monkeypatch.setattr(levels, "hindsight", lambda *of: (found.append(of[-1]), hindsight(*of))[1])
    return found


def refreshed(each, after_s=0.0, fresh=10):
    case, _ = turning(16)
    case = case._replace(log=case.log._replace(time_s=case.log.time_s + after_s))
    return each.decided(case, 4.0, case.model, scales_of(case.log, case.model.noise_variance), jumps=True, fresh=fresh)


def test_what_is_used_up_comes_back_with_time(asked):
    each, before = Deciding(), pacing.spent()
    turned, _ = refreshed(each)
    assert 0 < PER_S * MOST_S - each.left < pacing.spent() - before  # but for what is settled in any case
    each.left = -0.1 * PER_S
    left, profile = refreshed(each, 0.05)
    assert asked == [10]
    assert (profile.jerk == turning(16)[0].model.jerk).all()
    assert left.log.weight.sum() < turned.log.weight.sum()
    again, _ = refreshed(each, 0.05 + 0.11)
    assert asked == [10, 20]  # all that came since
    np.testing.assert_array_equal(again.log.weight, turned.log.weight)
    assert each.left < 0.01 * PER_S


def test_no_more_is_kept_than_for_a_moment(asked):
    each = Deciding()
    each.left = -10.0 * PER_S
    for after_s in (0.0, 1e9):  # a gap
        refreshed(each, after_s)
    assert not asked
    assert each.left == pytest.approx(-(10.0 - 2 * MOST_S) * PER_S)


def test_a_clock_that_goes_back_gives_and_takes_nothing():
    each = Deciding()
    refreshed(each)
    left = each.left
    refreshed(each, -5.0, fresh=0)
    assert each.left == left


def test_nothing_more_starts_when_enough_was_done_at_once(monkeypatch):
    """What else may hold is weighed with the next decisions."""
    each, tried = Deciding(), list[int]()
    refreshed(each)
    readmitted = deciding.readmitted
    monkeypatch.setattr(deciding, "readmitted", lambda *of: (tried.append(1), readmitted(*of))[1])
    monkeypatch.setattr(levels, "hindsight", lambda *_: pacing.swept(int(0.06 * PER_S)))
    refreshed(each, 0.1)
    assert not tried
    monkeypatch.setattr(levels, "hindsight", lambda *_: pacing.swept(int(0.04 * PER_S)))
    refreshed(each, 0.2)
    assert tried
