"""Whether a truth belongs to a trajectory: other axes, other clocks and other flights are told, errors are not."""

import re
from dataclasses import replace

import numpy as np
import pytest

from ftproc.records import Truth
from ftproc.scoring.agreement import doubt
from ftproc.simulation import simulate


@pytest.fixture(scope="module")
def flight():
    return simulate("manoeuvre-clean", seed=3, duration_s=60.0).truth


def said(flight, truth, off=0.0):
    noise = 2.0 * np.random.default_rng(1).standard_normal(flight.position_m.shape)
    return doubt("track", flight.time_s, flight.position_m + noise + off, replace(truth, name="truth"))


def test_errors_of_a_trajectory_are_no_doubt(flight):
    assert said(flight, flight) is None
    assert said(flight, flight, off=np.array([300.0, -100.0, 50.0])) is None
    assert said(flight, replace(flight, time_s=flight.time_s + 0.02)) is None


@pytest.mark.parametrize(("late_s", "words"), [
    (18.0, r"it is 18 s \(GPS against UTC\) ahead of"),
    (-18.0, r"it is 18 s \(GPS against UTC\) behind"),
    (2.37, r"it is 2\.37 s ahead of"),
    (-0.4, r"it is 0\.(4|399|401)\d* s behind"),
])  # fmt: skip
def test_another_clock_is_named_with_its_offset(flight, late_s, words):
    found = said(flight, replace(flight, time_s=flight.time_s + late_s))
    assert found is not None
    assert "far better when its clock is moved" in found
    assert re.search(words, found), found


def test_a_truth_an_hour_off_is_a_time_zone(flight):
    n, hours_s = 40_000, np.arange(0, 40_000, 1.0)
    position = np.stack([20_000 * np.cos(hours_s / 700), 9000 * np.sin(hours_s / 1100), 1000 + 0.1 * hours_s], 1)
    truth = Truth("truth", hours_s + 7200.0, position)
    found = doubt("track", hours_s, position + np.random.default_rng(0).standard_normal((n, 3)), truth)
    assert found is not None
    assert "it is 2 h (a time zone) ahead of" in found


def test_exchanged_axes(flight):
    assert "with x and y exchanged" in said(flight, replace(flight, position_m=flight.position_m[:, [1, 0, 2]]))


def test_another_flight(flight):
    other = simulate("manoeuvre-clean", seed=4, duration_s=60.0).truth
    assert "the truth of another flight" in said(flight, other)
    assert "from another origin" in said(flight, replace(flight, position_m=flight.position_m + 2e4))


def test_a_target_that_stands_is_not_of_another_flight():
    time_s = np.arange(0, 60, 0.1)
    position = np.tile([500.0, 200.0, 30.0], (600, 1))
    assert doubt("track", time_s, position + np.array([3.0, 0.0, 0.0]), Truth("truth", time_s, position)) is None


def test_nothing_to_compare(flight):
    assert doubt("track", flight.time_s, np.full_like(flight.position_m, np.nan), flight) is None
    late = replace(flight, time_s=flight.time_s + 1234.0)
    assert "it is 1234 s ahead" in doubt("track", flight.time_s, flight.position_m, late)
