"""Readings that jump beside a live track: bridged while they are off, and as they come when they are back."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing.two_pass import Known
from ftproc.core.live.editor import LiveEditor
from ftproc.core.live.kept import Kept
from ftproc.core.model.frames import from_cartesian
from ftproc.records import GOOD, PATCH
from ftproc.simulation import simulate
from tests import drone

NOISE = (0.5, 3e-4, 3e-4)  # m, rad, rad
TIME_S = np.arange(0, 48, 0.05)
AUTOMATIC = Known(np.full(3, np.nan), None, 4.0)
NEARLY = 0.97  # of the rows, within 5 sigma: where a manoeuvre begins a few are not


def flown(change=None, lag_s=0.0, keep=None):
    """Errors in sigmas (n,), the largest of the axes, and labels (n, 4) of a flight; change: what is done to its
    readings. keep: which of its rows there are."""
    log, position = drone.read(drone.CRUISER, drone.FAR, TIME_S, NOISE, 5)
    time_s, z = log.time_s, log.measurement.copy()
    if change is not None:
        change(time_s, z)
    rows = slice(None) if keep is None else keep(time_s)
    editor = LiveEditor(AUTOMATIC, lag_s)
    out = [*editor.push(time_s[rows], z[rows]), *editor.finish()]
    state, sigma = (np.concatenate([each.rows[name] for each in out]) for name in ("state", "sigma"))
    off = np.abs(state[:, :3] - position[rows]) / sigma[:, :3]
    return time_s[rows], off.max(1), np.concatenate([each.label for each in out])


def jump(component, sigmas, begin_s, end_s=np.inf):
    def change(time_s, z):
        z[(time_s >= begin_s) & (time_s < end_s), component] += sigmas * NOISE[component]

    return change


@pytest.mark.parametrize(("component", "sigmas", "lag_s"), [(0, 30.0, 0.0), (1, -20.0, 1.0), (2, 25.0, 0.0)])
def test_a_step_that_stays_is_bridged(component, sigmas, lag_s):
    time_s, off, label = flown(jump(component, sigmas, 30.0), lag_s)
    after = time_s > 30.5
    assert (off[after] < 5).mean() > NEARLY
    assert (label[after, component] == PATCH).mean() > 0.99
    assert (label[:, [c for c in range(3) if c != component]] == GOOD).mean() > 0.9


@pytest.mark.parametrize("component", [0, 1])
def test_after_a_patch_with_an_offset_readings_count_again(component):
    time_s, off, label = flown(jump(component, 25.0, 30.0, 38.0))
    assert (off[time_s > 30] < 5).mean() > NEARLY
    assert (label[(time_s > 30.5) & (time_s < 38), component] == PATCH).mean() > 0.99
    assert (label[time_s > 38.5, component] == GOOD).mean() > 0.98


def test_patches_that_follow_each_other_are_left_one_by_one():
    """Those that are over stay bridged by what they were off."""

    def change(time_s, z):
        jump(1, 25.0, 30.0, 32.0)(time_s, z)
        jump(1, -40.0, 33.0, 35.0)(time_s, z)
        jump(1, 60.0, 36.0, 37.0)(time_s, z)

    time_s, off, label = flown(change)
    assert (off[time_s > 30] < 5).mean() > NEARLY
    assert (label[time_s > 37.5, 1] == GOOD).mean() > 0.98


def test_a_reading_that_is_good_by_hand_is_as_it_came():
    """And those that follow."""
    kept = Kept.nothing()
    kept.take(np.ones((2, 3)), np.zeros((2, 3), bool), **of(2))
    kept["level"][-1], kept["level_sigma"][-1] = (0.1, 0.2, 0.3), 0.01
    by_hand = np.zeros((3, 3), bool)
    by_hand[1, 1] = True
    kept.take(np.ones((3, 3)), by_hand, **of(3))
    np.testing.assert_allclose(kept["measurement"][2:], [[0.9, 0.8, 0.7], [0.9, 1.0, 0.7], [0.9, 1.0, 0.7]])
    np.testing.assert_allclose(kept.came[2:, :3], 1.0)


def of(n):
    """What else is kept of n samples."""
    none = np.zeros(n)
    names = ("possible", "times", "late")
    return {name: np.ones((n, 3)) for name in names} | {"time_s": none, "rate": none, "rate_weight": none}


def test_another_target_is_left_together():
    """Its range has drifted, its angles have not: these tell that all is back."""

    def change(time_s, z):
        for c in range(3):
            jump(c, 30.0 + c, 30.0, 40.0)(time_s, z)
        z[:, 0] += np.where((time_s >= 30) & (time_s < 40), 3.0 * NOISE[0] * (time_s - 30), 0.0)

    time_s, off, label = flown(change)
    assert (off[time_s > 30] < 5).mean() > NEARLY
    assert (label[time_s > 40.5, :3] == GOOD).mean() > 0.98


def test_a_patch_with_more_than_an_offset_is_left_out_when_it_is_over():
    def change(time_s, z):
        patch = (time_s >= 30) & (time_s < 34)
        z[:, 1] += np.where(patch, 25 * NOISE[1] * (1 + ((time_s - 30) / 4) ** 2), 0.0)

    time_s, off, label = flown(change)
    assert (off[time_s > 35] < 5).mean() > NEARLY
    assert (label[time_s > 35, :3] == GOOD).mean() > 0.98


def test_where_a_track_has_followed_a_patch_the_return_is_no_jump():
    """The azimuth walks off from 98.9 s on, and is back at 99.5 s."""
    flight = simulate("manoeuvre", seed=400)
    rows = (flight.log.time_s > 50) & (flight.log.time_s < 104)
    time_s, editor = flight.log.time_s[rows], LiveEditor(AUTOMATIC)
    out = [*editor.push(time_s, flight.log.measurement[rows]), *editor.finish()]
    state, sigma = (np.concatenate([each.rows[name] for each in out])[:, :3] for name in ("state", "sigma"))
    true = np.isin(flight.truth.time_s, time_s)
    off = (np.abs(state - flight.truth.position_m[true]) / sigma).max(1)
    assert (off[time_s > 101] < 5).all()


def errors_live(flight, stop_s):
    """Times (n,), errors m and in sigmas of the live rows of a simulated flight, and labels (n, 4)."""
    rows = flight.log.time_s < stop_s
    time_s, editor = flight.log.time_s[rows], LiveEditor(AUTOMATIC)
    out = [*editor.push(time_s, flight.log.measurement[rows]), *editor.finish()]
    state, sigma = (np.concatenate([each.rows[name] for each in out])[:, :3] for name in ("state", "sigma"))
    off = np.abs(state - flight.truth.position_m[np.isin(flight.truth.time_s, time_s)])
    return time_s, np.sqrt((off**2).sum(1)), (off / sigma).max(1), np.concatenate([each.label for each in out])


def test_the_onset_of_a_manoeuvre_that_was_taken_for_a_jump_is_seen_by_more_readings():
    """Pulled at 11 s: the range leaves the track all at once. Nothing was ever to bring it back."""
    flight = simulate("manoeuvre-clean", seed=100, duration_s=120.0)
    time_s, _, off, label = errors_live(flight, 25.0)
    after = time_s > 12.5
    assert (off[after] < 5).all()
    assert (label[after, :3] == GOOD).mean() > 0.99


def test_the_end_of_a_patch_that_the_track_has_followed_is_no_jump():
    """Three times readings walk off within 4 s: an agile track follows, and is left where it went when they return."""
    flight = simulate("cruise", seed=101, duration_s=100.0, dt_s=0.1, outliers="none")
    walk, calm = np.linspace(0, 1, 40), np.ones(1001, bool)
    for k in range(3):
        begin = 200 * (2 + k)
        flight.log.measurement[begin : begin + 40, 0 if k % 2 else 2] += walk * (150 if k % 2 else -0.008)
        calm[begin : begin + 80] = False
    _, off_m, _, label = errors_live(flight, 101.0)
    assert (label[calm][:, [0, 2]] == GOOD).mean() > 0.95
    assert np.nanmean(off_m[calm] > 10) < 0.02


def test_a_track_that_begins_on_a_patch_returns():
    time_s, off, _ = flown(jump(1, 25.0, 0.0, 3.0))
    assert (off[time_s > 6] < 5).mean() > NEARLY


def test_clean_flights_have_no_levels():
    _, _, label = flown()
    assert (label[:, :3] == PATCH).mean() < 0.01


def test_after_a_gap_sigmas_allow_for_a_manoeuvre_in_it():
    """The target pushes and brakes by turns, and the gap begins when it has done neither for a while."""
    time_s = np.arange(0, 80, 0.05)
    push = 3.0 * np.sign(np.sin(2 * np.pi * time_s / 26.0)) * (np.abs(np.sin(2 * np.pi * time_s / 26.0)) > 0.2)
    along = np.cumsum(np.cumsum(push) * 0.05) * 0.05
    position = np.array([1500.0, 900.0, 300.0]) + along[:, None] * np.array([0.8, 0.6, 0.1])
    rng = np.random.default_rng(4)
    z = from_cartesian(position) + rng.normal(size=position.shape) * (2.0, 2e-4, 2e-4)
    rows = (time_s < 64) | (time_s > 69)
    editor = LiveEditor(AUTOMATIC)
    out = [*editor.push(time_s[rows], z[rows]), *editor.finish()]
    state, sigma = (np.concatenate([each.rows[name] for each in out]) for name in ("state", "sigma"))
    off = np.abs(state[:, :3] - position[rows]) / sigma[:, :3]
    after = (time_s[rows] > 69) & (time_s[rows] < 70)
    assert off[after].max() < 5
