"""Samples of stations that are not at the origin, and the columns that biases add to the smoother.

The columns are derivatives: so they are held against what a smoother with other biases does, and the
information against the likelihood's own curvature.
"""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering.beside import DISTANCE, RATE
from ftproc.core.filtering.biases import PARAMETERS, Directions, smooth_biased
from ftproc.core.filtering.forward import filter_log
from ftproc.core.filtering.records import Model, Observations, Scalars, Sites, Start
from ftproc.core.filtering.smoother import residuals_beside, smooth_log
from ftproc.core.model import stations
from ftproc.core.model.earth import MEAN_RADIUS_M as EARTH_M
from ftproc.core.model.frames import from_cartesian
from ftproc.core.model.motion import isotropic

pytestmark = pytest.mark.compiled

PLACES = np.array([[0.0, 0.0, 0.0], [9000.0, 2000.0, 100.0], [3000.0, -8000.0, 50.0]])
CENTRE = np.array([0.0, 0.0, -EARTH_M])
NOISE = np.array([3.0, 1e-4, 1e-4])
SCALE = np.array([2.0, 1e-4, 1e-4, 1e-4, 1e-4, 2e-3, 5.0, 3e-3])  # of small biases


def flown(time_s):
    t = np.asarray(time_s)
    position = np.stack([3000 + 150 * t, 12000 - 40 * t + 300 * np.sin(t / 8), 3000 + 30 * np.cos(t / 5)], 1)
    velocity = np.stack([150 + 0 * t, -40 + 37.5 * np.cos(t / 8), -6 * np.sin(t / 5)], 1)
    return np.hstack([position, velocity, np.zeros((len(t), 3))])


def rotation(seed):
    turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))


def observed(biases, n=240, seed=1):
    """Readings of three stations of which two have no range, by a filter that knows `biases` (3, 6)."""
    rng = np.random.default_rng(seed)
    time_s, station = np.sort(rng.uniform(0, 30, n)), rng.integers(0, 3, n)
    axes = np.stack([np.eye(3), rotation(1) @ np.eye(3), np.eye(3)])
    axes[1] = stations.levelled(np.eye(3)[None], np.array([[0.02, -0.01]]))[0]
    z = stations.measured(flown(time_s)[:, :3], PLACES[station], axes[station]) + rng.normal(size=(n, 3)) * NOISE
    z[station > 0, 0] = np.nan
    z[rng.random((n, 3)) < 0.05] = np.nan
    tilted = stations.levelled(axes, biases[:, 3:5])
    sites = Sites(station, PLACES, tilted, np.full(3, 1e4))
    weight = np.isfinite(z) * (rng.random((n, 3)) > 0.1)
    readings = time_s - biases[station, 5], z - biases[station, :3], weight.astype(float), None, sites
    return Observations(*readings, beside(time_s, station, biases, rng))


def beside(time_s, station, biases, rng):
    """Range rates of the last station, heights of the second."""
    state = flown(time_s)
    seen = state[:, :3] - PLACES[station]
    rate = (seen * state[:, 3:6]).sum(1) / np.linalg.norm(seen, axis=1) + 0.5 * rng.normal(size=len(seen))
    height = np.linalg.norm(state[:, :3] - CENTRE, axis=1) + 4.0 * rng.normal(size=len(seen))
    height -= biases[station, 6] + biases[station, 7] * (height - EARTH_M)
    weight = (rng.random(len(seen)) > 0.1).astype(float)
    rates = Scalars(np.where(station == 2, rate, np.nan), np.full(len(seen), 0.25), weight, RATE, PLACES[station])
    return rates, Scalars(np.where(station == 1, height, np.nan), np.full(len(seen), 16.0), weight, DISTANCE, CENTRE)


def unknown(log):
    """(2, n, 3) derivatives of the scalars by clock, offset and scale."""
    state = flown(log.time_s)
    found = np.zeros((2, len(state), 3))
    for k, scalars in enumerate(log.beside):
        late = np.diff([value_of(scalars, flown(log.time_s + step)) for step in (-1e-3, 1e-3)], axis=0)[0] / 2e-3
        found[k, :, 0] = -late
    found[1, :, 1], found[1, :, 2] = 1.0, np.linalg.norm(state[:, :3] - CENTRE, axis=1) - EARTH_M
    return found


def value_of(scalars, state):
    seen = state[:, :3] - scalars.point
    far = np.linalg.norm(seen, axis=1)
    return far if scalars.kind == DISTANCE else (seen * state[:, 3:6]).sum(1) / far


MODEL = Model(np.tile(NOISE**2, (3, 1)), isotropic(30.0))
START = Start(0, flown([0.0])[0], np.diag([1e6] * 3 + [1e4] * 3 + [1e3] * 3))


def directions(log, columns):
    station = log.sites.station
    design = stations.design(flown(log.time_s), PLACES[station], log.sites.axes[station])
    return Directions(design, columns, unknown(log))


def test_a_station_elsewhere_sees_what_it_would_see_from_its_own_frame():
    turn, place = rotation(5), np.array([4000.0, -700.0, 120.0])
    time_s = np.linspace(0, 20, 150)
    z = from_cartesian(flown(time_s)[:, :3]) + np.random.default_rng(2).normal(size=(150, 3)) * NOISE
    model = Model(NOISE**2, isotropic(30.0))
    own = Observations(time_s, z, np.ones((150, 3)))
    sites = Sites(np.zeros(150, np.int64), place[None], turn[None], np.array([1e4]))
    elsewhere = own._replace(sites=sites)
    both = np.kron(np.eye(3), turn.T)
    start = START._replace(covariance=np.eye(9) * 100.0)
    moved = Start(0, both @ start.state + np.r_[place, np.zeros(6)], start.covariance)
    model_there = model._replace(noise_variance=model.noise_variance[None])
    for run in (smooth_log, filter_log):
        here, there = run(own, model, [start]), run(elsewhere, model_there, [moved])
        assert there.state == pytest.approx(here.state @ both.T + np.r_[place, np.zeros(6)], abs=1e-6)
        assert there.log_likelihood == pytest.approx(here.log_likelihood, abs=1e-6)


def test_at_the_origin_it_is_the_single_station_to_the_last_digits():
    time_s = np.linspace(0, 20, 150)
    z = from_cartesian(flown(time_s)[:, :3]) + np.random.default_rng(2).normal(size=(150, 3)) * NOISE
    own = Observations(time_s, z, np.ones((150, 3)))
    sites = Sites(np.zeros(150, np.int64), np.zeros((1, 3)), np.eye(3)[None], np.array([1e4]))
    here = smooth_log(own, Model(NOISE**2, isotropic(30.0)), [START])
    there = smooth_log(own._replace(sites=sites), Model(NOISE[None] ** 2, isotropic(30.0)), [START])
    assert np.array_equal(here.state, there.state)
    assert np.array_equal(here.sigma, there.sigma)


def test_without_columns_it_is_the_smoother():
    log = observed(np.zeros((3, PARAMETERS)))
    plain = smooth_log(log, MODEL, [START])
    found = smooth_biased(log, MODEL, START, directions(log, np.zeros((3 * PARAMETERS, 0))))
    # Two kernels: the compiler may order the sums of one in another way.
    np.testing.assert_allclose(found.run.state, plain.state, rtol=1e-9, atol=1e-7)
    np.testing.assert_allclose(found.run.sigma, plain.sigma, rtol=1e-9)
    np.testing.assert_allclose(found.run.residual, plain.residual, rtol=1e-9, atol=1e-9)
    assert found.run.log_likelihood == pytest.approx(plain.log_likelihood, rel=1e-12)
    assert not found.spread.any()
    np.testing.assert_allclose(found.beside, residuals_beside(log, MODEL, [START]), rtol=1e-9, atol=1e-7)


def test_several_blocks_are_as_one(monkeypatch):
    log = observed(np.zeros((3, PARAMETERS)))
    columns = np.eye(3 * PARAMETERS)[:, [0, 9, 17]]
    one = smooth_biased(log, MODEL, START, directions(log, columns))
    monkeypatch.setattr("ftproc.core.filtering.biases.BLOCK", 50)
    found = smooth_biased(log, MODEL, START, directions(log, columns))
    for name in ("state", "sigma", "residual", "residual_variance"):
        np.testing.assert_array_equal(getattr(found.run, name), getattr(one.run, name), err_msg=name)
    np.testing.assert_array_equal(found.spread, one.spread)
    np.testing.assert_array_equal(found.beside, one.beside)
    np.testing.assert_allclose(found.info, one.info, rtol=1e-12)


@pytest.mark.parametrize("parameter", range(PARAMETERS))
@pytest.mark.parametrize("station", range(3))
def test_the_score_is_the_slope_of_the_likelihood(station, parameter):
    if (station > 0 and parameter == 0) or (station != 1 and parameter > 5):
        return  # no range, no heights
    column = np.zeros((3 * PARAMETERS, 1))
    column[station * PARAMETERS + parameter] = SCALE[parameter]
    log = observed(np.zeros((3, PARAMETERS)))
    found = smooth_biased(log, MODEL, START, directions(log, column))
    step = 0.1 * column.reshape(3, PARAMETERS)
    up, down = (smooth_log(observed(sign * step), MODEL, [START]).log_likelihood for sign in (1, -1))
    size = np.sqrt(found.info[0, 0])
    assert (up - down) / 0.2 == pytest.approx(found.score[0], abs=0.05 * size + 0.02 * abs(found.score[0]))


def test_columns_are_the_derivative_of_the_smoothed_state():
    column = np.zeros((3 * PARAMETERS, 1))
    column[[0, 9, 10, 16 + 2, 8 + 3, 16 + 4], 0] = SCALE[[0, 1, 2, 2, 3, 4]]
    log = observed(np.zeros((3, PARAMETERS)))
    plain = smooth_log(log, MODEL, [START])
    found = smooth_biased(log, MODEL, START, directions(log, column))
    known = smooth_log(observed(column.reshape(3, PARAMETERS)), MODEL, [START])
    moved = np.abs(known.state - plain.state)[:, :6]
    added = np.sqrt(found.run.sigma**2 - plain.sigma**2)[:, :6]
    assert added == pytest.approx(moved, rel=0.02, abs=0.02 * moved.max(0).min())


def test_left_out_residuals_allow_for_the_biases():
    """A station's bias that nobody else sees: its own reading, left out, is all that the rest leaves open."""
    column = np.zeros((3 * PARAMETERS, 1))
    column[PARAMETERS + 1, 0] = 1e-3
    log = observed(np.zeros((3, PARAMETERS)))
    plain = smooth_log(log, MODEL, [START])
    information = smooth_biased(log, MODEL, START, directions(log, column)).info[0, 0]
    column /= np.sqrt(1 + information)  # what is left of it
    found = smooth_biased(log, MODEL, START, directions(log, column))
    own = (log.sites.station == 1) & (log.weight[:, 1] > 0)
    assert (found.run.residual_variance[own, 1] > plain.residual_variance[own, 1]).all()
    assert (found.run.residual_variance[own, 1] < 2 * plain.residual_variance[own, 1]).all()
    heights = np.isfinite(log.beside[1].value)
    assert (found.beside[1, heights, 1] >= residuals_beside(log, MODEL, [START])[1, heights, 1]).all()
    unused = (log.weight == 0) & np.isfinite(log.measurement)
    assert (found.run.residual_variance[unused] >= plain.residual_variance[unused]).all()


def test_the_smoother_starts_later_and_looks_back():
    log = observed(np.zeros((3, PARAMETERS)))
    column = np.zeros((3 * PARAMETERS, 1))
    column[1, 0] = 1e-4
    late = Start(40, flown(log.time_s)[40], START.covariance)
    found = smooth_biased(log, MODEL, late, directions(log, column))
    plain = smooth_log(log, MODEL, [late])
    assert found.run.state == pytest.approx(plain.state, rel=1e-9)
    assert np.isfinite(found.run.sigma).all()
