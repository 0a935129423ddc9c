"""A track while it is flown: `Live`, and a log that is followed."""

from __future__ import annotations

import json
import subprocess
import sys

import numpy as np
import pandas as pd
import pytest

import ftproc
from ftproc.errors import InputError, UsageError
from ftproc.methods.height import heights
from ftproc.settings import FilterSettings
from tests.simulated import simulate

SETTINGS = FilterSettings(editing="live", lag_s=1.0)


@pytest.fixture(scope="module")
def log():
    return simulate("manoeuvre", seed=5, duration_s=15.0, dt_s=0.1).log


def pushed(log, order, settings=SETTINGS):
    track = ftproc.Live(settings)
    parts = [track.push(log.time_s[k], *log.measurement[k]) for k in order] + [track.finish()]
    assert track.waiting == 0
    return track, {
        name: np.concatenate([getattr(p, name) for p in parts])
        for name in ("row", "time_s", "state", "sigma", "measurement_sigma", "outlier")
    }


def test_one_by_one_it_is_what_the_file_gives(log):
    _, found = pushed(log, range(len(log)))
    whole = ftproc.filter_log(log, SETTINGS)
    np.testing.assert_array_equal(found["state"], whole.state)
    np.testing.assert_array_equal(found["outlier"], whole.outlier)
    np.testing.assert_array_equal(found["sigma"], whole.sigma)
    np.testing.assert_array_equal(found["measurement_sigma"], whole.measurement_sigma)


@pytest.mark.parametrize("model", ["packaged", None])
def test_without_a_lag_the_network_corrects_each_row_as_in_the_file(log, model):
    """By what is known when the row leaves; a row that is coasted has no correction."""
    settings = FilterSettings(editing="live")
    track, whole = ftproc.Live(settings, model=model), ftproc.filter_log(log, settings, model=model)
    parts = [track.push(log.time_s[k], *log.measurement[k]) for k in range(len(log))]
    for name in ("state", "correction", "measurement", "sigma"):
        np.testing.assert_array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
    assert np.abs(whole.correction[:, :3]).max() > 0.1 if model else not whole.correction.any()
    assert not track.coast(0.1).correction.any()
    if model:
        assert "proven by the innovations of this run" in whole.metadata["summary"]["network"]


@pytest.mark.parametrize("at_once", [1, 40])
def test_late_rows_take_their_place_as_if_they_had_come_in_time(log, at_once):
    """By less than the lag; one in ten, and the very first."""
    rng = np.random.default_rng(4)
    delay = np.where(rng.random(len(log)) < 0.1, rng.uniform(0, 0.99, len(log)), 0.0)
    delay[0] = 0.5
    order = np.argsort(log.time_s + delay, kind="stable")
    track, whole = ftproc.Live(SETTINGS), ftproc.filter_log(log, SETTINGS)
    parts = [track.push(log.time_s[k], *log.measurement[k].T, row=k) for k in batches(order, at_once)]
    parts.append(track.finish())
    assert track.late == 0
    for name in ("row", "time_s", "state", "sigma", "outlier"):
        np.testing.assert_array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))


def test_heights_as_they_come_are_those_of_the_whole_log():
    log, settings = simulate("surveillance-2d", seed=2).log, FilterSettings(editing="live", lag_s=20.0)
    track, whole = ftproc.Live(settings, barometric=True), ftproc.filter_log(log, settings)
    stand_in = heights.elevation(log.heights.above_m, log.measurement[:, 0])
    parts = [track.push(t, r, a, e) for t, (r, a, _), e in zip(log.time_s, log.measurement, stand_in, strict=True)]
    parts.append(track.finish())
    for name in ("row", "time_s", "state", "sigma", "outlier", "measurement", "measurement_sigma"):
        np.testing.assert_array_equal(np.concatenate([getattr(part, name) for part in parts]), getattr(whole, name))
    labels = [each for part in parts if len(part) for each in part.extra.column("outlier_height").to_pylist()]
    assert labels == whole.extra.column("outlier_height").to_pylist()


def batches(order, at_once):
    return [order[low : low + at_once] for low in range(0, len(order), at_once)]


def clocked(log, delay_s, pause_after=None):
    """The rows by the clock, as they come so long after their times, and so long after its lag each is published."""
    track, parts, waited = ftproc.Live(SETTINGS), [], []
    came_s = log.time_s + delay_s

    def out(part, now_s):
        parts.append(part)
        waited.extend(now_s - came_s[part.row] - SETTINGS.lag_s)

    for k in np.argsort(came_s, kind="stable"):
        while track.due_s < came_s[k]:
            now_s = track.due_s
            out(track.due(now_s), now_s)
        out(track.push(log.time_s[k], *log.measurement[k], row=k, came_s=came_s[k]), came_s[k])
    while track.waiting:
        now_s = track.due_s
        out(track.due(now_s), now_s)
    state = np.concatenate([part.state for part in parts])
    return track, np.concatenate([part.row for part in parts]), state, np.array(waited)


def test_rows_leave_by_the_clock_when_their_lag_has_passed(log):
    """The last ones too, for which nothing comes any more; and they are those of the whole log."""
    _, row, state, waited = clocked(log, np.zeros(len(log)))
    assert waited.max() < 0.005
    np.testing.assert_array_equal(row, np.arange(len(log)))
    np.testing.assert_array_equal(state, ftproc.filter_log(log, SETTINGS).state)


def test_rows_wait_longer_where_readings_come_late(log):
    """The first late one changes only what had not left; from then on rows wait for as late ones."""
    delay_s = np.zeros(len(log))
    delay_s[60::9] = 0.35
    track, row, state, waited = clocked(log, delay_s)
    same = (state == ftproc.filter_log(log, SETTINGS).state[row]).all(1) | np.isnan(state[:, 0])
    assert track.late == 0
    assert (~same).sum() <= 4  # they had left before anybody was late
    assert same[65:].all()
    assert waited[:40].max() < 0.005
    assert waited.max() <= 1.0


def test_work_and_memory_are_bounded_when_all_rows_come_late(log):
    track = ftproc.Live(SETTINGS)
    for k in range(0, len(log) - 1, 2):
        for row in (k + 1, k):
            track.push(log.time_s[row], *log.measurement[row], row=row)
    assert len(track._order._copies) < 5
    assert len(track._order._fed[0]) < 1000


def test_coasted_rows_change_nothing_that_comes_later(log):
    track, parts, coasted = ftproc.Live(SETTINGS), [], []
    for k in range(len(log)):
        if k == 80:
            parts.append(track.due(np.inf))
            coasted = [track.coast(0.1 * n) for n in range(1, 11)]
        parts.append(track.push(log.time_s[k], *log.measurement[k], row=k, came_s=0.0))
    parts.append(track.finish())
    whole = ftproc.filter_log(log, SETTINGS)
    state = np.concatenate([part.state for part in parts])
    np.testing.assert_array_equal(state[80:], whole.state[80:])
    rows = np.concatenate([part.row for part in coasted])
    sigma = np.concatenate([part.sigma for part in coasted])[:, 0]
    np.testing.assert_array_equal(rows, -1)
    np.testing.assert_allclose(
        np.concatenate([part.time_s for part in coasted]), log.time_s[79] + 0.1 * np.arange(1, 11)
    )
    assert sigma[-1] > 2 * sigma[0]
    off = np.linalg.norm(coasted[4].state[0, :3] - whole.state[84, :3])
    assert off < 4 * np.linalg.norm(coasted[4].sigma[0, :3])


def test_too_late_rows_are_counted(log):
    order = np.r_[np.arange(40), np.arange(41, len(log)), 40]
    track, found = pushed(log, order)
    assert track.late == 1
    assert len(found["row"]) == len(log) - 1


def test_rows_keep_the_numbers_that_they_are_given(log):
    track, n = ftproc.Live(), 5
    found = track.push(log.time_s[:n], *log.measurement[:n].T, row=[3, 4, 7, 8, 20])
    assert found.row.tolist() == [3, 4, 7, 8, 20]
    with pytest.raises(InputError, match="there are 2 row numbers for 1 readings"):
        track.push(9.0, 1.0, 0.0, 0.0, row=[1, 2])
    with pytest.raises(InputError, match="row 30: the time nan s is not that of a flight"):
        track.push(np.nan, 1.0, 0.0, 0.0, row=30)


def test_wrong_use_is_refused(log):
    with pytest.raises(UsageError, match="not smoothed"):
        ftproc.Live(FilterSettings(method="ukf"))
    track = ftproc.Live()
    with pytest.raises(InputError, match="is not that of a flight"):
        track.push(np.nan, 1.0, 0.0, 0.0)
    with pytest.raises(InputError, match="there are 2 times for 1 readings"):
        track.push([1.0, 2.0], 1.0, 0.0, 0.0)


def written(log, path):
    names = ("range_m", "azimuth_rad", "elevation_rad")
    pd.DataFrame({"time_s": log.time_s, **dict(zip(names, log.measurement.T, strict=True))}).to_csv(path, index=False)


def test_followed_rows_leave_before_the_input_ends(log, tmp_path):
    written(log, tmp_path / "log.csv")
    command = [sys.executable, "-m", "ftproc", "filter", "-", "--follow", "jsonl", "--lag", "1"]
    with subprocess.Popen(command, bufsize=0, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        text = (tmp_path / "log.csv").read_bytes()
        process.stdin.write(text[: len(text) // 2])
        process.stdin.flush()
        first = json.loads(process.stdout.readline())  # while the input is open
        rest, _ = process.communicate(text[len(text) // 2 :])
    assert process.returncode == 0
    rows = [first, *map(json.loads, rest.splitlines())]
    whole = ftproc.filter_log(tmp_path / "log.csv", SETTINGS)
    assert [row["row"] for row in rows] == list(range(len(log)))
    assert [row["x_m"] for row in rows] == [None if np.isnan(x) else x for x in whole.state[:, 0]]


def test_a_bad_line_is_named(tmp_path):
    (tmp_path / "log.csv").write_text("time_s,range_m,azimuth_rad,elevation_rad\n0,1000,0,1\n1,far,0,1\n")
    command = [sys.executable, "-m", "ftproc", "filter", "-", "--follow"]
    with (tmp_path / "log.csv").open() as stream:
        done = subprocess.run(command, stdin=stream, capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert 'line 3: the range is "far", which is no number' in done.stderr


@pytest.mark.parametrize(
    ("at", "lag_s", "pause_s"), [(60, 0.5, 3.0), pytest.param(100, 1.0, 2.9, marks=pytest.mark.slow), (143, 2.5, 40.0)]
)
def test_rows_before_a_pause_do_not_hang_on_when_they_leave(at, lag_s, pause_s):
    """By the clock, one by one, or with the reading after the pause."""
    log = simulate("manoeuvre", seed=5, duration_s=10.0, dt_s=0.05).log
    times = log.time_s + pause_s * (np.arange(len(log)) >= at)
    settings = FilterSettings(editing="live", lag_s=lag_s)
    at_once, by_the_clock = ftproc.Live(settings), ftproc.Live(settings)
    whole = [at_once.push(times, *log.measurement.T), at_once.finish()]
    found = []
    for k, now_s in enumerate(times.tolist()):
        while by_the_clock.due_s <= now_s - 1e-9:
            found.append(by_the_clock.due(by_the_clock.due_s))
        found.append(by_the_clock.push(now_s, *log.measurement[k], np.array([k]), now_s))
    found.append(by_the_clock.finish())
    for name in ("state", "sigma", "outlier"):
        np.testing.assert_array_equal(*(np.concatenate([getattr(p, name) for p in parts]) for parts in (found, whole)))
