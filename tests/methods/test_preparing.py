"""What all methods begin with."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import two_pass
from ftproc.core.filtering.smoother import HEADS, smooth_log
from ftproc.methods import anti_outlier, preparing
from ftproc.methods.estimate import Readings
from ftproc.methods.papers import kalman, robust
from ftproc.settings import FilterSettings
from tests.methods.flights import PATHS, TIME, measured
from tests.simulated import simulate

UNKNOWN = np.full(3, np.nan)


def helix(time_s, spoiled=()):
    z = measured(PATHS["helix"](time_s), time_s).measurement
    z[list(spoiled)] += [300.0, 0.05, 0.05]
    return Readings(time_s, z, UNKNOWN)


@pytest.mark.parametrize("spoiled", [(), (1, 4)])
@pytest.mark.parametrize("method", [anti_outlier.estimate, kalman.converted, robust.huber])
def test_every_method_begins_with_the_state_that_two_passes_find(method, spoiled):
    readings = helix(TIME[:200], spoiled)
    edited = anti_outlier.estimate(readings, FilterSettings(motion="white-jerk")).run
    first = method(readings, FilterSettings(editing="none", motion="white-jerk")).run
    assert edited.since_start[0] == first.since_start[0] == 0
    np.testing.assert_allclose(first.predicted[0], edited.predicted[0], rtol=1e-9)


@pytest.mark.parametrize(("dt_s", "sojourn_s"), [(0.1, 5.0), (1.0, 20.0)])
def test_a_model_of_several_holds_for_five_seconds_or_twenty_intervals(dt_s, sojourn_s):
    readings = helix(dt_s * np.arange(120))
    usual, said, other = (
        kalman.multiple(readings, FilterSettings(method="imm-ukf", parameters=parameters)).run.state
        for parameters in ((), (("sojourn_s", sojourn_s),), (("sojourn_s", 3 * sojourn_s),))
    )
    np.testing.assert_array_equal(usual, said)
    assert (usual != other).any()


def test_starts_are_where_all_the_record_says_with_wider_covariances():
    """The readings of many memories after a start say all that there is to say of it."""
    flight = simulate("manoeuvre", seed=4, duration_s=150.0, outliers="gap=2:8-9")
    edited = two_pass.edit(flight.log.time_s, flight.log.measurement, two_pass.Known(UNKNOWN, None, 4.0))
    starts = preparing.smoothed_starts(edited.log, edited.model, edited.starts)
    heads = smooth_log(edited.log, edited.model, edited.starts, HEADS).heads
    assert len(edited.log.time_s) > 4 * preparing.FEWEST
    assert [start.sample for start in starts] == [head.sample for head in heads]
    for start, head in zip(starts, heads, strict=True):
        sigma = np.sqrt(np.diag(head.covariance))
        np.testing.assert_array_less(np.abs(start.state - head.state), 0.02 * sigma)
        wider = start.covariance - preparing.START_INFLATION * head.covariance
        np.testing.assert_array_less(np.abs(wider), 0.15 * np.outer(sigma, sigma))


def test_smoothed_start_of_a_short_log_is_the_head_with_a_wider_covariance():
    flight = simulate("cruise", seed=4, duration_s=20.0)
    edited = two_pass.edit(flight.log.time_s, flight.log.measurement, two_pass.Known(UNKNOWN, None, 4.0))
    (start,) = preparing.smoothed_starts(edited.log, edited.model, edited.starts)
    (head,) = edited.smoothed().heads
    assert len(edited.log.time_s) < preparing.FEWEST
    assert start.sample == head.sample
    np.testing.assert_array_equal(start.state, head.state)
    wider = start.covariance / preparing.START_INFLATION - head.covariance
    sigma = np.sqrt(np.diag(head.covariance))
    np.testing.assert_array_less(np.abs(wider), 1e-2 * np.outer(sigma, sigma))
    assert np.linalg.eigvalsh(start.covariance[:3, :3]).min() > 0
