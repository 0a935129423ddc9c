"""A correction of live rows: it does not come and go with the refreshes of the window, and the innovations prove it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from ftproc.core.filtering.records import FilterRun
from ftproc.correction import model_file
from ftproc.correction.apply import correct
from ftproc.correction.features import SETTLING, BoolArray, LineOfSight, lever_m
from ftproc.correction.live import MEMORY, PRIOR, USUAL, LiveCorrection
from ftproc.methods import live
from ftproc.records import FloatArray, IntArray
from ftproc.settings import FilterSettings
from tests.correction import fake
from tests.correction.test_apply import constant
from tests.simulated import simulate

SECONDS = {20.0: 30.0, 50.0: 16.0, 200.0: 6.0}  # Hz: of the flight


@cache
def flown(rate: float, lag_s: float) -> FilterRun:
    log = simulate("manoeuvre", seed=5, duration_s=SECONDS[rate], dt_s=1 / rate).log
    editor, found = live.editor(FilterSettings(editing="live", lag_s=lag_s)), []
    for low in range(0, len(log), 7):
        found += editor.push(log.time_s[low : low + 7], log.measurement[low : low + 7])
    found += editor.finish()
    return FilterRun.of(log.time_s, np.concatenate([each.rows for each in found]), 0.0)


@pytest.mark.parametrize("lag_s", [0.0, 0.5])
@pytest.mark.parametrize("rate", SECONDS)
def test_a_constant_correction_is_constant(rate: float, lag_s: float) -> None:
    """In units of the sigmas it is the same for all rows, from the one on with which the track has settled."""
    run = flown(rate, lag_s)
    applied = np.linalg.norm(correct(run, constant("window", 1.0)).values, axis=1)
    settled = np.flatnonzero(applied)
    assert settled[0] < 60
    used = np.flatnonzero((run.weight > 0).any(1))
    np.testing.assert_array_equal(settled, used[used >= settled[0]])
    np.testing.assert_array_equal(np.diff(run.since_start[settled[0] :]), 1)
    in_sigmas = applied[settled] / np.linalg.norm(run.los_sigma[settled, :6], axis=1)
    assert np.ptp(in_sigmas) < 1e-9


@pytest.mark.parametrize("rate", SECONDS)
def test_the_packaged_correction_goes_in_steps(rate: float) -> None:
    """In units of the published sigmas along the line of sight, whatever the innovations and refreshes do; but where
    these sigmas collapse, which it keeps within."""
    run, packaged = flown(rate, 0.0), model_file.named("packaged")
    assert packaged is not None
    values = LiveCorrection().of(run, packaged.filter)
    on = (run.los_sigma > 0).all(1)
    los = los_of(run, np.flatnonzero(on)[1:])
    jumps, along = (los.from_cartesian(each) / los.sigma for each in (np.diff(values[on], axis=0), values[on][1:]))
    assert np.abs(values).max() > 0.3
    free = np.abs(along) < packaged.filter.bound - 1e-9
    assert np.abs(jumps[free]).max() < 0.3 + 1e-9
    assert (~free).sum() <= 5  # 3 of 4,068 numbers


def los_of(run: FilterRun, rows: BoolArray | IntArray) -> LineOfSight:
    return LineOfSight.of(run, 0, len(run.time_s)).rows(rows)


def test_rows_may_come_in_any_pieces() -> None:
    run, packaged = flown(20.0, 0.0), model_file.named("packaged")
    assert packaged is not None
    whole, correction = LiveCorrection().of(run, packaged.filter), LiveCorrection()
    edges = [0, *range(1, 40), 100, 101, 400, len(run.time_s)]
    parts = [
        correction.of(run.rows(a, b), packaged.filter) for a, b in zip(edges, [*edges[1:], edges[-1]], strict=True)
    ]
    np.testing.assert_array_equal(np.concatenate(parts), whole)


def track(n: int, share: float, noise: float = 2.0) -> tuple[FilterRun, FloatArray]:
    """A run whose innovations are such a share of what a constant correction by one sigma changes in the predictions,
    and noise so many times as large; and the correction that the last row would have with a gain of one (6,)."""
    run = fake.run(np.random.default_rng(0), n)
    run = run._replace(since_start=np.arange(n), weight=np.ones((n, 3)), los_sigma=np.ones((n, 6)))
    passed = np.diff(run.time_s, prepend=run.time_s[0])[:, None]
    moved = (1.0 + passed) / lever_m(run.predicted[:, :3])
    spread = noise * moved
    innovation = share * moved + spread * np.random.default_rng(1).normal(size=(n, 3))
    return run._replace(innovation=innovation, innovation_sigma=spread), np.ones(6)


@pytest.mark.parametrize("share", [-1.0, 0.0, 0.5, 1.0, 3.0])
def test_the_innovations_prove_the_gain(share: float) -> None:
    run, whole = track(3 * MEMORY, share)
    values = LiveCorrection().of(run, constant("motion", 1.0))
    along = los_of(run, np.ones(len(values), bool)).from_cartesian(values)
    assert along[-1] == pytest.approx(np.clip(share, 0.0, 1.0) * whole, abs=0.15)


def test_a_correction_is_bounded_by_the_sigmas_of_its_row() -> None:
    """Where these collapse from row to row, as the noise is found anew."""
    run, _ = track(MEMORY, 1.0)
    run.los_sigma[-9:] = 0.01
    values = LiveCorrection().of(run, constant("motion", 1.5))
    along = np.abs(los_of(run, np.ones(len(values), bool)).from_cartesian(values))
    assert along[-10].min() > 0.5
    assert along[-9:].max() < 2.0 * 0.01 + 1e-9


def test_a_track_is_corrected_from_its_first_row_on() -> None:
    """A filter that began without a smoother, unlike that after two-pass editing, lags from the beginning."""
    run, packaged = flown(20.0, 0.0), model_file.named("packaged")
    assert packaged is not None
    values = LiveCorrection().of(run, packaged.filter)
    first = int(np.flatnonzero((run.weight > 0).any(1))[0])
    assert np.flatnonzero(values.any(1))[0] <= first + 2
    assert not correct(run, packaged.filter, run.state).values[first : first + SETTLING].any()


def test_innovations_that_say_nothing_leave_the_usual_gain() -> None:
    run, whole = track(2 * SETTLING, -1.0, noise=1e3)
    values = LiveCorrection().of(run, constant("motion", 1.0))
    along = los_of(run, np.ones(len(values), bool)).from_cartesian(values)
    assert along[-1] == pytest.approx(PRIOR * whole, abs=0.01)


def test_a_sigma_that_grows_while_a_component_coasts_does_not_count() -> None:
    run, _ = track(MEMORY, 1.0)
    run.los_sigma[-9:, 0] = 50.0
    values = LiveCorrection().of(run, constant("motion", 1.0))
    along = los_of(run, np.ones(len(values), bool)).from_cartesian(values)
    assert 0.0 < along[-1, 0] < 1.1 * USUAL


def test_a_new_track_has_proven_nothing() -> None:
    run, _ = track(2 * MEMORY, -1.0)
    correction = LiveCorrection()
    assert not correction.of(run, constant("motion", 1.0))[-1].any()
    again = correction.of(run, constant("motion", 1.0))
    np.testing.assert_array_equal(again, LiveCorrection().of(run, constant("motion", 1.0)))
