"""The second filter of a live window, and how much of it is published."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.records import empty_rows
from ftproc.core.live import turning
from ftproc.methods import live
from ftproc.settings import FilterSettings
from tests.simulated import simulate

pytestmark = pytest.mark.compiled


@pytest.fixture(scope="module")
def flight():
    return simulate("manoeuvre-clean", seed=1, duration_s=40.0)


def rows_of(flight, **settings):
    editor = live.editor(FilterSettings(**{"editing": "live", **settings}))
    found = editor.push(flight.log.time_s, flight.log.measurement) + editor.finish()
    return editor, np.concatenate([each.rows for each in found])


@pytest.mark.parametrize(("editing", "most"), [("live", 0.97), ("forward", 0.99)])
def test_a_manoeuvre_is_followed_better(flight, editing, most):
    """Decisions are the same, and positions and velocities are nearer to the truth."""
    (_, mixed), (_, white) = (rows_of(flight, editing=editing, motion=name) for name in ("auto", "white-jerk"))
    np.testing.assert_array_equal(mixed["weight"], white["weight"])
    known = flight.log.time_s > 8.0  # the beginning of a track knows no turn
    for part, truth in ((slice(0, 3), flight.truth.position_m), (slice(3, 6), flight.truth.velocity_mps)):
        errors = [np.sqrt(((each["state"][known, part] - truth[known]) ** 2).mean()) for each in (mixed, white)]
        assert errors[0] < most * errors[1]


def test_a_manoeuvre_is_followed_better_without_elevations(flight):
    """In what is seen: range and azimuth."""
    log, errors = flight.log, []
    measurement = np.column_stack([log.measurement[:, :2], np.full(len(log), np.nan)])
    polar = np.column_stack(
        [np.linalg.norm(flight.truth.position_m, axis=1), np.arctan2(*flight.truth.position_m[:, 1::-1].T)]
    )
    for motion in ("auto", "white-jerk"):
        editor = live.editor(FilterSettings(editing="live", motion=motion))
        rows = np.concatenate([each.rows for each in editor.push(log.time_s, measurement)])
        x, y, z = rows["state"][:, :3].T
        off = np.column_stack([np.sqrt(x**2 + y**2 + z**2), np.arctan2(y, x)]) - polar
        off[:, 1] = np.angle(np.exp(1j * off[:, 1]))
        errors.append(np.sqrt((off[log.time_s > 8.0] ** 2).mean(0)))
    assert (errors[0] < 0.98 * errors[1]).all()


@pytest.mark.parametrize("settings", [{"motion": "white-jerk"}, {"jerk_psd_m2ps5": 10.0}])
def test_white_jerk_that_is_asked_for_is_alone(flight, settings):
    editor, _ = rows_of(flight, **settings)
    assert not editor.window.turning.acts


def test_forward_editing_is_white_jerk_alone_where_a_reading_is_rejected():
    log = simulate("manoeuvre", seed=3, duration_s=20.0, dt_s=0.04, outliers="isolated=0.1:20-300").log
    found = []
    for motion in ("auto", "white-jerk"):
        editor = live.editor(FilterSettings(editing="forward", motion=motion))
        found.append(np.concatenate([each.rows for each in editor.push(log.time_s, log.measurement)]))
    mixed, white = found
    rejected = (mixed["weight"] <= 0).any(1)
    np.testing.assert_array_equal(mixed["weight"], white["weight"])
    np.testing.assert_array_equal(mixed["state"][rejected], white["state"][rejected])
    assert rejected.any()
    assert (mixed["state"][~rejected] != white["state"][~rejected]).any()


def row(state, innovation):
    rows = empty_rows(1)
    rows["state"], rows["sigma"], rows["weight"] = state, 1.0, 1.0
    rows["innovation_sigma"], rows["nis"] = 1.0, 3 * innovation**2
    return rows


def test_a_filter_that_diverges_is_not_published():
    """Whatever it was worth before."""
    second = turning.Second()
    second.odds, here, astray = turning.MOST, row(0.0, 1.0), row(1e6, 1e3)
    second.run = float(turning._gained(here, astray)[0])
    turning._mix(here, astray, np.full(1, second.weight), turning.MIXED)
    np.testing.assert_array_equal(here["state"], 0.0)
    np.testing.assert_array_equal(here["sigma"], 1.0)


def test_one_without_numbers_speaks_for_nothing():
    assert turning._gained(row(0.0, 1.0), row(np.nan, np.nan))[0] == -np.inf


def test_the_sigmas_allow_for_the_difference():
    here = row(0.0, 1.0)
    turning._mix(here, row(2.0, 1.0), np.full(1, 0.5), turning.MIXED)
    np.testing.assert_allclose(here["state"], 1.0)
    np.testing.assert_allclose(here["sigma"], np.sqrt(2.0))
