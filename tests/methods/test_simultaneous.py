"""Hundreds of rows of one stamp."""

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
