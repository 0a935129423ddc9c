"""What every method must live with: missing readings, odd times, the cut, logs of a few rows."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from ftproc import pipeline
from ftproc.errors import InputError
from ftproc.methods import registry
from ftproc.records import GOOD, ISOLATED, MISSING, PATCH
from ftproc.settings import FilterSettings
from tests.methods.flights import PATHS, TIME, measured, turned

#: bpnn-ekf without its network is the EKF; see test_registry.
NAMES = [name for name, method in registry.METHODS.items() if not method.own_model]

#: Wavelets take samples as even, so odd times cost them more than 25 %.
ROOM = {"wavelet-akf": 2.0}


def run(log, name, seed=0):
    return pipeline.filter_log(log, FilterSettings(method=name, seed=seed))


def ticks(name):
    """TIME, half of it for a method of particles, which is slow."""
    return TIME[:300] if registry.METHODS[name].random else TIME


@cache
def undisturbed(name):
    """The helix, measured at even times without a fault."""
    return run(measured(PATHS["helix"](ticks(name)), ticks(name)), name)


def rms(trajectory, position):
    error = np.sum((trajectory.state[:, :3] - position) ** 2, 1)
    assert np.isfinite(error).mean() > 0.4  # without its bad and incomplete readings a gate has no more
    return np.sqrt(np.nanmean(error))


def blanked(log, share, seed=0):
    z = log.measurement.copy()
    z[np.random.default_rng(seed).random(z.shape) < share] = np.nan
    return replace(log, measurement=z)


@pytest.mark.parametrize("name", NAMES)
def test_no_method_is_worse_than_the_readings_of_a_clean_log(name):
    """Each component off by 1 sigma is 3.4 m at 5 km on average; a random walk lags a little behind."""
    time, found = ticks(name), undisturbed(name)
    position = PATHS["helix"](time)
    raw = np.sqrt(np.mean(np.sum((measured_position(measured(position, time)) - position) ** 2, 1)))
    assert rms(found, position) < 1.02 * raw
    assert (found.outlier == GOOD).mean() > 0.97


@pytest.mark.parametrize("name", NAMES)
def test_a_method_publishes_a_sigma_or_none(name):
    found = undisturbed(name)
    for sigma in (found.sigma, found.measurement_sigma):
        assert (np.isnan(sigma) | (sigma > 0)).all()
    position, cleaned = np.isfinite(found.sigma[:, :3]), np.isfinite(found.measurement_sigma)
    np.testing.assert_array_equal(position.all(1), cleaned.all(1))


def measured_position(log):
    r, a, e = log.measurement.T
    return np.stack([r * np.cos(e) * np.cos(a), r * np.cos(e) * np.sin(a), r * np.sin(e)], 1)


@pytest.mark.parametrize("name", NAMES)
def test_missing_readings(name):
    """Their label says so, nothing else is lost, and no method loses the track."""
    time = ticks(name)
    position = PATHS["helix"](time)
    log = blanked(measured(position, time), 0.2)
    missing = np.isnan(log.measurement)
    found = run(log, name)
    np.testing.assert_array_equal(found.outlier == MISSING, missing)
    assert np.isfinite(found.state[~missing.any(1), :3]).all(1).mean() > 0.95
    assert rms(found, position) < 1.7 * rms(undisturbed(name), position)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("component", range(3))
def test_component_missing_throughout(name, component):
    log = measured(PATHS["helix"](TIME[:100]), TIME[:100])
    z = log.measurement.copy()
    z[:, component] = np.nan
    found = run(replace(log, measurement=z), name)
    if component < 2:
        assert np.isnan(found.state).all()
    else:  # a height stands in for the elevation
        assert np.isfinite(found.state[:, :3]).all(1).mean() > 0.9
    assert np.isnan(found.measurement[:, component]).all()
    others = [c for c in range(3) if c != component]
    off = np.abs(found.measurement - log.measurement)[:, others] / np.array([3.0, 2e-4, 2e-4])[others]
    assert np.nanmedian(off) < 4


@pytest.mark.parametrize("name", NAMES)
def test_jittered_and_irregular_times(name):
    rng, time = np.random.default_rng(1), ticks(name)
    times = np.sort(time + 0.045 * rng.uniform(-1, 1, len(time)))
    times[len(time) // 2 :] += 2.0  # a gap
    position = PATHS["helix"](times)
    even = rms(undisturbed(name), PATHS["helix"](time))
    assert rms(run(measured(position, times), name), position) < ROOM.get(name, 1.25) * even


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("path", ["radial", "swinging across the cut", "orbit"])
def test_cut_costs_nothing(name, path):
    """The flight turned by a quarter, away from the cut, has the same error (about, if chance decides)."""
    by_chance = registry.METHODS[name].random
    times = TIME[430:490] if by_chance else TIME[300:]  # when the orbit crosses it
    position = PATHS[path](times)
    away = turned(position, np.pi / 2)
    found, found_away = (
        [run(measured(where, times), name, seed) for seed in range(2 if by_chance else 1)] for where in (position, away)
    )
    mean, mean_away = (np.mean([rms(f, p) for f in each]) for each, p in ((found, position), (found_away, away)))
    assert mean == pytest.approx(mean_away, rel=0.4 if by_chance else 1e-2)
    azimuth = found[0].measurement[:, 1]
    assert (np.abs(azimuth[np.isfinite(azimuth)]) <= np.pi).all()
    if not by_chance:
        np.testing.assert_array_equal(found[0].outlier, found_away[0].outlier)


@pytest.mark.parametrize("name", NAMES)
def test_two_readings_at_every_instant(name):
    time = ticks(name)
    twice = np.repeat(np.arange(len(time)), 2)
    position = PATHS["helix"](time)
    found = run(measured(position[twice], time[twice]), name)
    assert rms(found, position[twice]) < ROOM.get(name, 1.25) * rms(undisturbed(name), position)


@pytest.mark.parametrize("name", [n for n in NAMES if registry.METHODS[n].handles_outliers and n != "rkf-literal"])
def test_isolated_outliers_are_found_and_do_little_harm(name):
    rng, time = np.random.default_rng(2), ticks(name)
    position = PATHS["helix"](time)
    clean = measured(position, time)
    bad = np.zeros(clean.measurement.shape, bool)
    for c in range(3):
        bad[rng.choice(np.arange(20, len(time) - 10, 10), len(time) // 40, replace=False) + c, c] = True
    z = clean.measurement + bad * np.array([400.0, 0.1, 0.1]) * rng.choice([-1, 1], bad.shape)
    found = run(replace(clean, measurement=z), name)
    assert np.isin(found.outlier[bad], (ISOLATED, PATCH)).mean() > 0.9
    near = [np.nanpercentile(np.linalg.norm(t.state[:, :3] - position, axis=1), 95) for t in (found, undisturbed(name))]
    assert near[0] < 2 * near[1]


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("rows", [1, 2, 3, 5, 9])
def test_logs_of_a_few_rows(name, rows):
    log = measured(PATHS["helix"](TIME))
    found = run(replace(log, time_s=TIME[:rows], measurement=log.measurement[:rows], row=log.row[:rows]), name)
    assert len(found) == rows
    assert not np.isinf(found.state).any()


def test_lost_track_of_a_robust_filter_is_a_sentence(monkeypatch):
    monkeypatch.setattr("ftproc.methods.papers.robust.LOST_AT", 0.5)
    message = r"^flight\.csv: mcc-ukf lost the track, and cannot re-acquire it; use ga-bpnn-ukf$"
    with pytest.raises(InputError, match=message):
        run(measured(PATHS["receding"](TIME)), "mcc-ukf")
