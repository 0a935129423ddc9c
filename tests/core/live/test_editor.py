"""The live editor: what a row rests on, and how good it is."""

from __future__ import annotations

import copy
from functools import cache

import numpy as np
import pytest

from ftproc.core.live.window import Window
from ftproc.methods import live
from ftproc.settings import FilterSettings
from tests.simulated import simulate

pytestmark = pytest.mark.compiled

SPEC = "isolated=0.05:6-300,offset=2:8-30:20-200,stuck=1:8-20,nan=0.02"
WAYS = {
    "live": {"editing": "live"},
    "lag": {"editing": "live", "lag_s": 0.5},
    "forward": {"editing": "forward"},
    "specified": {"editing": "forward", "noise": (5.0, 1e-4, 1e-4), "jerk_psd_m2ps5": 10.0},
}


@pytest.fixture(scope="module")
def flight():
    return simulate("manoeuvre", seed=3, duration_s=12.0, dt_s=0.04, outliers=SPEC)


def rows(log, stop, way, step):
    """The rows that have left an editor after `stop` readings that came `step` at a time."""
    editor = live.editor(FilterSettings(**WAYS[way]))
    found = []
    for low in range(0, stop, step):
        high = min(low + step, stop)
        found += editor.push(log.time_s[low:high], log.measurement[low:high])
    names = ("state", "sigma", "nis", "weight", "innovation")
    parts = {name: np.concatenate([each.rows[name] for each in found]) for name in names}
    return {**parts, "label": np.concatenate([each.label[:, :3] for each in found])}


@pytest.fixture(scope="module")
def whole(flight):
    """whole(way) -> the rows of the flight when all its readings come at once, made once."""
    return cache(lambda way: rows(flight.log, len(flight.log), way, 1000))


@pytest.mark.parametrize("way", WAYS)
def test_no_row_knows_the_future_and_none_depends_on_how_readings_come(flight, whole, way):
    for stop, step in ((len(flight.log), 1), (len(flight.log) - 60, 7)):
        part = rows(flight.log, stop, way, step)
        count = len(part["state"])
        lag_s = WAYS[way].get("lag_s", 0.0)
        assert flight.log.time_s[count] + lag_s >= flight.log.time_s[stop - 1] if count < stop else lag_s == 0
        for name, values in part.items():
            np.testing.assert_array_equal(values, whole(way)[name][:count], err_msg=f"{name} {stop}")


def test_sigmas_of_rows_that_leave_follow_the_last_innovations(flight):
    editor, times = live.editor(FilterSettings(editing="live")), []
    for k in range(len(flight.log)):
        leaving = editor.push(flight.log.time_s[k : k + 1], flight.log.measurement[k : k + 1])
        if editor.window is not None and np.isfinite(leaving[-1].rows["sigma"][-1]).all():
            (filtered, _) = editor.window.shown(len(editor.window) - 1, len(editor.window))
            times.append(leaving[-1].rows["sigma"][-1] / filtered["sigma"][0])
    assert np.ptp(times, axis=1).max() < 1e-9
    assert np.min(times) > 1 - 1e-9
    assert 0.2 < (np.array(times)[:, 0] > 1.01).mean() < 0.8


def test_lag_makes_it_better_and_outliers_are_found(flight, whole):
    truth = flight.truth.position_m
    error = {}
    for way in ("live", "lag"):
        found = whole(way)
        there = np.isfinite(found["state"][:, 0])
        assert there[20:].all()
        count = len(there)
        off = np.linalg.norm(found["state"][there, :3] - truth[:count][there], axis=1)
        error[way] = np.sqrt(np.mean(off**2))
        bad = flight.truth.outlier[:count][there] > 0
        said = np.isin(found["label"][there], (1, 2))
        assert said[bad].mean() > 0.8
        assert said[~bad & np.isfinite(flight.log.measurement[:count][there])].mean() < 0.04
    assert error["lag"] < 0.8 * error["live"]


def test_a_component_that_comes_later_and_one_that_never_comes(flight):
    log = flight.log
    measurement = log.measurement.copy()
    measurement[:150, 0] = np.nan
    editor = live.editor(FilterSettings(editing="live"))
    editor.push(log.time_s[:100], measurement[:100])
    assert editor.absent == (0,)
    editor.push(log.time_s[100:200], measurement[100:200])
    assert editor.absent == ()
    assert editor.window is not None


def test_a_wrong_first_stretch_is_left_again(flight):
    """Twelve readings beside the track: what is confirmed on them does not last for another fifty."""
    measurement = flight.log.measurement.copy()
    measurement[:12, :2] += [900.0, 0.03]
    editor = live.editor(FilterSettings(editing="live"))
    found = editor.push(flight.log.time_s[:60], measurement[:60])
    state = np.concatenate([each.rows["state"] for each in found])
    there = np.isfinite(state[:, 0])
    off = np.linalg.norm(state[there, :3] - flight.truth.position_m[:60][there], axis=1)
    assert len(off) > 8
    assert off[-8:].max() < 100


def test_memory_is_constant_and_rows_stay_with_their_readings(flight):
    editor = live.editor(FilterSettings(**WAYS["specified"]))
    sizes, missing = [], np.isnan(flight.log.measurement)
    for k in range(60):
        found = editor.push(flight.log.time_s + 12.1 * k, flight.log.measurement)
        sizes.append(len(editor.window))
        if k > 0:  # the track is confirmed
            rows = np.concatenate([each.rows["innovation"] for each in found])
            np.testing.assert_array_equal(np.isnan(rows), missing)
    assert max(sizes) <= 2 * 4096 + 2 * editor.window.sizes.window


def floods(flight):
    """Times and readings with which the clock stands still, goes on by almost nothing, or by years."""
    t, z = flight.log.time_s, flight.log.measurement
    last_s, many = float(t[99]), np.tile(z, (6, 1))
    few = np.repeat(last_s + 0.04 * np.arange(1.0, 7.0), 250)
    for times in (np.full(1500, last_s), last_s + 1e-13 * np.arange(1500.0), few, last_s + 1e7 * np.arange(1.0, 9.0)):
        yield np.concatenate([t[:100], times, times[-1] + t[1:60]]), np.vstack([z[:100], many[: len(times)], z[1:60]])


@pytest.mark.parametrize(
    ("number", "way"),
    [
        pytest.param(number, way, marks=[] if number in quick else pytest.mark.slow)
        for way, quick in (("live", (0, 3)), ("lag", ()), ("forward", (1, 2)))
        for number in range(4)
    ],
)
def test_floods_are_counted_out_and_do_not_depend_on_how_rows_come(flight, monkeypatch, way, number):
    times, readings = list(floods(flight))[number]
    runs = []
    for step in (10_000, 173):
        editor, found, kept = live.editor(FilterSettings(**WAYS[way])), [], 0
        for low in range(0, len(times), step):
            found += editor.push(times[low : low + step], readings[low : low + step])
            kept = max(kept, editor.count - editor._first)
        found += editor.finish()
        assert [each.first for each in found] == np.cumsum([0, *(len(each.rows) for each in found[:-1])]).tolist()
        assert sum(len(each.rows) for each in found) == len(times)
        state, sigma = (np.concatenate([each.rows[name] for each in found]) for name in ("state", "sigma"))
        known = np.isfinite(state).all(1)
        assert (sigma[known] > 0).all()
        assert np.isnan(state[~known]).all()
        runs.append(state)
    np.testing.assert_array_equal(*runs)


@pytest.mark.parametrize("way", ["live", pytest.param("lag", marks=pytest.mark.slow)])
def test_what_is_kept_is_bounded_whatever_the_times(flight, way):
    editor, sizes = live.editor(FilterSettings(**WAYS[way])), []
    editor.push(flight.log.time_s[:100], flight.log.measurement[:100])
    for _ in range(30):
        editor.push(np.full(700, flight.log.time_s[99]), np.tile(flight.log.measurement[99], (700, 1)))
        sizes.append(editor.count - editor._first)
    assert max(sizes) < 8 * 4096
    assert editor.published > 15_000


def test_rows_wait_for_a_track_in_memory_that_does_not_grow():
    editor = live.editor(FilterSettings(editing="live", lag_s=0.5))
    for k in range(40):
        editor.push(20.0 * k + 0.1 * np.arange(200), np.full((200, 3), np.nan))
        assert len(editor.waiting.time_s) < 4000
    assert editor.window is None


def test_nonsense_is_kept_in_memory_that_does_not_grow():
    editor, nonsense = live.editor(FilterSettings(editing="live", lag_s=0.5)), np.random.default_rng(1)
    sizes = []
    for k in range(4):
        readings = nonsense.uniform([100, -3, -1], [1e5, 3, 1], (200, 3))
        editor.push(20.0 * k + 0.1 * np.arange(200), readings)
        sizes.append(editor.count - editor._first)
    assert max(sizes) < 600


@pytest.mark.parametrize("way", ["live", "lag"])
def test_rows_leave_by_the_clock_as_they_would_with_the_next_reading(flight, whole, way):
    """Ticks between readings, and copies that go on: all rows are the same, and leave when their lag has passed."""
    log, found = flight.log, []
    editor, lag_s = live.editor(FilterSettings(**WAYS[way])), WAYS[way].get("lag_s", 0.0)
    for k, moment in enumerate(log.time_s[:-1]):
        found += editor.push(log.time_s[k : k + 1], log.measurement[k : k + 1])
        found += editor.tick(moment + 0.035)
        waiting = editor.count + len(editor.held.time_s) - editor.published
        assert waiting == (log.time_s[: k + 1] + lag_s >= moment + 0.035).sum()
        if k % 50 == 20:
            editor = copy.deepcopy(editor)
    state = np.concatenate([each.rows["state"] for each in found])
    np.testing.assert_array_equal(state, whole(way)["state"][: len(state)])
    assert len(state) > len(whole(way)["state"]) - 2


@pytest.mark.parametrize("absent", [(0,), (2,), (1, 2)])
@pytest.mark.parametrize("way", ["live", "lag", "forward"])
def test_a_track_of_fewer_components_is_confirmed(flight, way, absent):
    """Angles alone, or no elevation: what stands in for the others is not taken for stuck."""
    measurement = flight.log.measurement[:150].copy()
    measurement[:, list(absent)] = np.nan
    editor = live.editor(FilterSettings(**WAYS[way]))
    found = editor.push(flight.log.time_s[:150], measurement)
    assert editor.absent == absent
    label = np.concatenate([each.label for each in found])
    known = np.concatenate([each.known for each in found])
    assert known[40:].all()
    assert (label[:, list(absent)] == 3).all()
    there = [c for c in range(3) if c not in absent]
    bad = flight.truth.outlier[: len(label), there] > 0
    assert (label[40:, there][bad[40:]] > 0).mean() > (0.3 if way == "forward" else 0.7)


@pytest.mark.parametrize("lag_s", [0.0, 2.0])
def test_after_a_gap_in_which_the_target_may_go_anywhere_a_track_begins_again(lag_s):
    """A hard turn, a gap of 15 s. A filter that goes on linearises kilometres away: 100 km off, for a second."""
    flight = simulate("family", seed=707)
    late = flight.log.time_s > 60.0
    time_s, position_m = flight.log.time_s[late], flight.truth.position_m[late]
    found = rows_of_part(time_s, flight.log.measurement[late], lag_s)
    after = time_s > 111.0
    error = np.sqrt(((found["state"][:, :3] - position_m) ** 2).sum(1))
    known = np.isfinite(error)
    if lag_s == 0:
        assert 4 <= np.count_nonzero(~known & after) <= 20
        assert not known[after][:4].any()
    else:
        assert known[after].all()
    assert known[~after][20:].all()
    assert error[known & after].max() < 25.0
    assert found["sigma"][known & after, :3].max() < 25.0


def rows_of_part(time_s, measurement, lag_s):
    editor = live.editor(FilterSettings(editing="live", lag_s=lag_s))
    found = [*editor.push(time_s, measurement), *editor.finish()]
    return {name: np.concatenate([each.rows[name] for each in found]) for name in ("state", "sigma")}


@pytest.mark.parametrize("lag_s", [0.0, 0.48, pytest.param(0.5, marks=pytest.mark.slow)])
def test_what_is_put_off_may_be_done_at_any_moment(flight, lag_s):
    """Between any two readings, or with the next one; with a lag, most of it is put off, and rows need not wait for
    it: they leave with the reading that is their lag later."""
    log, drawn, settings = flight.log, np.random.default_rng(4), FilterSettings(editing="live", lag_s=lag_s)
    editor, at_once = live.editor(settings), live.editor(settings).push(flight.log.time_s, flight.log.measurement)
    found, put_off = [], 0
    for k in range(len(log)):
        found += editor.push(log.time_s[k : k + 1], log.measurement[k : k + 1])
        if editor.window is not None:
            passed = int(np.searchsorted(log.time_s, log.time_s[k] - lag_s + 1e-6, side="right"))
            assert editor.published == passed
        put_off += editor.put_off
        if drawn.random() < 0.5:
            editor.work()
            assert not editor.put_off
    assert (put_off > 0.1 * len(log)) == (lag_s > 0)
    state, whole = (np.concatenate([each.rows["state"] for each in some]) for some in (found, at_once))
    np.testing.assert_array_equal(state, whole)


def test_no_row_waits_for_what_its_last_reading_sets_off(monkeypatch):
    """The newest part is decided on again after the rows have left, without that reading or with the next one."""
    log = simulate("manoeuvre-clean", seed=3, duration_s=12.0, dt_s=0.04).log
    editor, seen, refresh = live.editor(FilterSettings(editing="live", lag_s=0.48)), list[float](), Window.refresh
    monkeypatch.setattr(Window, "refresh", lambda window: (seen.append(window.time_s[-1]), refresh(window)))
    old, refreshes = 100, 0
    for k in range(len(log)):
        seen.clear()
        editor.push(log.time_s[k : k + 1], log.measurement[k : k + 1])
        refreshes += k > old and len(seen) > 0
        assert k <= old or all(time_s < log.time_s[k] for time_s in seen)
    assert refreshes > 50


def test_a_track_in_doubt_is_edited_bit_by_bit(monkeypatch):
    """In more turns than one, each of three times the work of others."""
    log, turns, go_on = simulate("manoeuvre", seed=1, duration_s=20.0, dt_s=0.01).log, [], Window.go_on

    def counted(window, samples):
        go_on(window, samples)
        turns.append((samples if samples == np.inf else round(samples / editor.pace.work), window.under_way is None))

    monkeypatch.setattr(Window, "go_on", counted)
    editor = live.editor(FilterSettings(editing="live", lag_s=0.5))
    editor.push(log.time_s, log.measurement)
    of_doubt = [done for work, done in turns if work == 3]
    assert {work for work, _ in turns} == {np.inf, 1, 3}  # all at once where a track begins
    assert len(of_doubt) > sum(of_doubt) > 0
