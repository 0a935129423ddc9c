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


def test_late_rows_take_their_place_and_too_late_ones_are_counted(log):
    order = np.arange(len(log))
    order[[80, 81, 82]] = [82, 80, 81]
    track, found = pushed(log, order)
    assert track.late == 0
    assert (np.diff(found["time_s"]) >= 0).all()
    assert sorted(found["row"]) == list(range(len(log)))
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
