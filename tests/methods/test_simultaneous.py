"""Hundreds of rows of one stamp, and several plots in a turn."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pytest

from ftproc import pipeline
from ftproc.files.reading import logs
from ftproc.methods import simultaneous
from ftproc.records import GOOD, ISOLATED, MISSING
from ftproc.settings import FilterSettings
from ftproc.simulation import simulate

SIGMA = np.array([3.0, 2e-4, 2e-4])


def flight(times, still=False):
    """Positions at 1 Hz, (60, 3), and the log with each of them read so many times at once."""
    truth = simulate("manoeuvre", seed=3, duration_s=60.0, outliers="none").truth
    position = np.repeat(truth.position_m[::20], times, 0)
    position = position[:1].repeat(len(position), 0) if still else position
    x, y, z = position.T
    reading = np.c_[np.sqrt(x * x + y * y + z * z), np.arctan2(y, x), np.arctan2(z, np.hypot(x, y))]
    reading += np.random.default_rng(times).standard_normal(reading.shape) * SIGMA
    return position, np.repeat(truth.time_s[::20], times), reading


def smoothed(time_s, reading, **settings):
    names = ("time_s", "range_m", "azimuth_rad", "elevation_rad")
    table = pa.table(dict(zip(names, (time_s, *reading.T.copy()), strict=True)))
    return pipeline.filter_log(logs.read(table), FilterSettings(smooth=True, **settings))


def rmse(found, position):
    return float(np.sqrt(((found.state[:, :3] - position) ** 2).sum(1).mean()))


@pytest.mark.parametrize("still", [False, True])
def test_more_readings_at_once_make_a_better_estimate(still):
    one, many = (
        rmse(smoothed(time_s, reading), position)
        for position, time_s, reading in (flight(times, still) for times in (1, 60))
    )
    assert many < 0.5 * one


def test_each_row_has_the_state_of_its_stamp_and_its_own_label():
    position, time_s, reading = flight(40)
    reading[105, 0] += 200.0
    reading[206:208, 1] = np.nan
    reading[400:440, 2] += 0.1  # all of a stamp
    found = smoothed(time_s, reading)
    assert len(found.time_s) == len(time_s)
    np.testing.assert_array_equal(found.state[::40].repeat(40, 0), found.state)
    assert rmse(found, position) < 2.0
    expected = np.full(reading.shape, GOOD)
    expected[105, 0], expected[206:208, 1], expected[400:440, 2] = ISOLATED, MISSING, ISOLATED
    assert (found.outlier == expected).mean() > 0.9999
    counts = found.metadata["summary"]["components"]["azimuth"]
    assert counts["missing"] == 2
    assert sum(counts[name] for name in ("good", "isolated", "patch", "missing")) == len(time_s)


def test_some_rows_of_one_stamp_stay_readings_of_their_own():
    _, time_s, reading = flight(simultaneous.MOST)
    assert simultaneous.together(time_s, reading) is None


@pytest.mark.parametrize("angular", [False, True])
def test_means_are_those_of_a_plain_loop(angular):
    rng = np.random.default_rng(7)
    group = np.sort(rng.integers(0, 20, 400))
    values = rng.normal(0.0, 0.1, 400) + 3.1
    values[rng.choice(400, 9, replace=False)] += 2.0
    values = (values + np.pi) % (2 * np.pi) - np.pi if angular else values
    mean, off = simultaneous._means(values, group, angular)

    def away(a, b):
        return (a - b + np.pi) % (2 * np.pi) - np.pi if angular else a - b

    scatter, middles = np.zeros(400), {}
    for g in np.unique(group):
        rows = np.flatnonzero(group == g)
        base = values[rows[0]]
        middles[g] = base + sorted(away(values[k], base) for k in rows)[len(rows) // 2]
        for k in rows:
            scatter[k] = abs(away(values[k], middles[g]))
    limit = simultaneous.CUT * simultaneous.SIGMA * np.median(scatter)
    np.testing.assert_array_equal(off, scatter > limit)
    for g, got in zip(np.unique(group), mean, strict=True):
        rows = [k for k in np.flatnonzero(group == g) if scatter[k] <= limit]
        expected = middles[g] + np.mean([away(values[k], middles[g]) for k in rows])
        assert abs(away(got, expected)) < 1e-12


def ship(turns=300, ends=100.0, seed=2, outlier=None):
    """A ship of 200 m at 8 m/s, seen by bow and stern, one to four plots in each turn of 2.5 s: the middle of it (n, 3)
    and the log."""
    random = np.random.default_rng(seed)
    turn = np.repeat(np.arange(turns), random.integers(1, 5, turns))
    time_s = 2.5 * turn + 0.012 * (np.arange(len(turn)) - np.searchsorted(turn, turn))
    along = np.array([0.88, 0.48, 0.0])
    position = np.array([-4000.0, 5000.0, 15.0]) + 8.0 * time_s[:, None] * along
    x, y, z = (position + ends * random.choice([-1.0, 1.0], (len(turn), 1)) * along).T
    reading = np.c_[np.sqrt(x * x + y * y + z * z), np.arctan2(y, x), np.full(len(turn), np.nan)]
    reading[:, :2] += random.standard_normal((len(turn), 2)) * np.array([8.0, 2e-3])
    if outlier is not None:
        reading[outlier, 0] += 1000.0
    return position, time_s, reading


@pytest.mark.parametrize("seed", [2, 4])
def test_bow_and_stern_are_one_ship(seed):
    position, time_s, reading = ship(seed=seed)
    found = smoothed(time_s, reading, height=(15.0, 20.0))
    error = found.state[:, :2] - position[:, :2]
    assert np.sqrt((error**2).sum(1).mean()) < 25.0
    assert (np.abs(error) <= 3 * found.sigma[:, :2]).all(1).mean() > 0.95
    assert (found.outlier[:, 0] == GOOD).mean() > 0.98
    assert found.metadata["summary"]["plots_at_once"] > 300


def test_an_outlier_among_plots_is_its_row_alone():
    _, time_s, reading = ship(ends=0.0, outlier=200)
    found = smoothed(time_s, reading, height=(15.0, 20.0))
    assert np.flatnonzero(found.outlier[:, 0] != GOOD).tolist() == [200]


def merged(time_s, reading):
    return simultaneous.plots(time_s, reading)


def test_a_mean_of_plots_has_so_much_less_variance():
    _, time_s, reading = ship()
    found = merged(time_s, reading)
    count = np.diff(found.first)
    np.testing.assert_allclose(found.times[:, 0], 1 / count)
    k = int(np.argmax(count))
    rows = slice(found.first[k], found.first[k + 1])
    np.testing.assert_allclose(found.measurement[k], reading[rows].mean(0))
    np.testing.assert_allclose(found.time_s[k], time_s[rows].mean())


@pytest.mark.parametrize("kind", ["one a turn", "uneven", "quick", "copies", "bursts", "shots"])
def test_other_logs_stay_as_they_are(kind):
    random = np.random.default_rng(1)
    reading = random.standard_normal((400, 3)) + np.array([1000.0, 1.0, 0.1])
    time_s = {
        "one a turn": 2.5 * np.arange(400) + random.uniform(0, 0.02, 400),
        "uneven": np.sort(random.uniform(0, 1000, 400)),
        "quick": 0.05 * (np.arange(400) // 2) + 0.001 * (np.arange(400) % 2),
        "copies": 2.5 * (np.arange(400) // 2),
        "shots": 10.0 * (np.arange(400) // 20) + 0.005 * (np.arange(400) % 20),
        "bursts": 10.0 * (np.arange(400) // 20) + 0.05 * (np.arange(400) % 20),
    }[kind]
    reading = reading[np.arange(400) // 2] if kind == "copies" else reading
    assert merged(time_s, reading) is None
