"""The opposite of a decision, tried where a patch may have been followed."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core import indicators, swaps
from ftproc.core.swaps import Neighbourhood
from tests.core.tracks import matched

RATES = np.tile(np.array(indicators.START_RATES), (3, 1))


def followed(component=0, begin=190, end=215, flank=8, sigmas=12.0):
    """A flight with a patch, and decisions that keep it and reject the good readings on both sides."""
    a = matched(4, 400, q=0.5)
    z = a.z.copy()
    z[begin:end, component] += sigmas * np.sqrt(a.model.noise_variance[component])
    wrong, right = a.weight.copy(), a.weight.copy()
    wrong[begin - flank : begin, component] = 0.0
    wrong[end : end + flank, component] = 0.0
    right[begin:end, component] = 0.0
    log = Neighbourhood(a.time, z, np.isfinite(z), a.model, RATES, 4.0)
    return log, wrong, right


@pytest.mark.parametrize("component", range(3))
def test_patch_that_was_followed_is_given_up(component):
    log, wrong, right = followed(component)
    found = swaps.try_opposites(log, wrong)
    np.testing.assert_array_equal(found[190:215, component], 0.0)
    assert (found == right).mean() > 0.998


@pytest.mark.parametrize("component", range(3))
def test_right_decisions_stay(component):
    log, _, right = followed(component)
    np.testing.assert_array_equal(swaps.try_opposites(log, right), right)
    two = right.copy()  # good readings between two real patches are no patch
    two[225:235, component] = 0.0
    log.measurement[225:235, component] += 20 * np.sqrt(log.model.noise_variance[component])
    np.testing.assert_array_equal(swaps.try_opposites(log, two), two)


def test_islands_lie_between_two_rejected_runs():
    weight = np.ones((60, 3))
    possible = np.ones((60, 3), bool)
    weight[10:14, 1] = weight[20:23, 1] = 0.0
    weight[30:32, 1] = 0.0  # too short to be a patch
    weight[50:55, 2] = 0.0  # no second run
    possible[16, 1] = False
    weight[4:8, 2] = 0.0
    time = 0.1 * np.arange(60)
    assert swaps.islands(time, weight, possible) == [
        (1, 0, 0, 10, 14),
        (1, 10, 14, 20, 23),
        (1, 20, 23, 60, 60),
        (2, 0, 0, 4, 8),
        (2, 4, 8, 50, 55),
        (2, 50, 55, 60, 60),
    ]


def test_islands_end_at_gaps():
    weight = np.ones((60, 3))
    weight[20:24, 0] = 0.0
    time = 0.1 * np.arange(60)
    time[30:] += 2.0
    assert swaps.islands(time, weight, weight > -1) == [(0, 0, 0, 20, 24), (0, 20, 24, 30, 30)]
    time[22:] += 2.0  # within the rejected run it ends nothing
    assert swaps.islands(time, weight, weight > -1) == [(0, 0, 0, 20, 24), (0, 20, 24, 30, 30)]


def test_far_apart_runs_have_no_island_between_them():
    weight = np.ones((200, 3))
    weight[60:64, 0] = weight[64 + swaps.LONGEST + 1 : 120, 0] = 0.0
    assert swaps.islands(0.1 * np.arange(200), weight, np.ones((200, 3), bool)) == []


def test_neighbourhood_that_says_too_little_is_left():
    log, wrong, _ = followed()
    log.measurement[:, 2] = np.nan
    log = log._replace(possible=np.isfinite(log.measurement))
    wrong = wrong * log.possible
    np.testing.assert_array_equal(swaps.try_opposites(log, wrong), wrong)
