"""Outliers of a channel by its own neighbours."""

import numpy as np
import pytest

from ftproc.methods.height import alone

STEP = 7.62  # 25 ft


def heights(n=240, dt=4.0, seed=0):
    """Level, climb, level, descent: m, with the times, s."""
    rng = np.random.default_rng(seed)
    t = np.arange(n) * dt + rng.uniform(-0.5, 0.5, n)
    rate = np.interp(t, np.array([0, 200, 220, 500, 520, 700, 730, 960]), [0, 0, 12, 12, 0, 0, -9, -9])
    height = 4000 + np.r_[0, np.cumsum(rate[:-1] * np.diff(t))]
    return t, np.round(height / STEP) * STEP


@pytest.mark.parametrize("dt", [1.0, 4.0, 12.0])
def test_a_climb_has_no_outliers(dt):
    t, x = heights(dt=dt)
    assert alone.good(t, x, STEP / np.sqrt(12)).all()


@pytest.mark.parametrize("seed", range(8))
def test_garbled_ones_are_found_and_nothing_else(seed):
    rng = np.random.default_rng(seed)
    t, x = heights(seed=seed)
    bad = rng.random(len(t)) < 0.03
    x[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(60, 6000, bad.sum())
    x[rng.random(len(t)) < 0.05] = np.nan
    good = alone.good(t, x, STEP / np.sqrt(12))
    assert not good[bad].any()
    wrong = ~good & ~bad & np.isfinite(x)
    assert wrong.sum() <= 2
    assert not good[np.isnan(x)].any()


@pytest.mark.parametrize("length", [2, 5, 11, 60])
def test_a_patch_is_found_whole(length):
    t, x = heights()
    x[100 : 100 + length] += 900.0
    good = alone.good(t, x, STEP / np.sqrt(12))
    assert (~good).sum() == length
    assert not good[100 : 100 + length].any()


@pytest.mark.parametrize("n", range(6))
def test_few_readings(n):
    t = np.arange(float(n))
    assert alone.good(t, 100.0 + t, 1.0).all()


def test_where_nothing_is_read_for_long_the_line_stands_in():
    t = np.arange(0, 1000, 4.0)
    x = 3000 + 5 * t
    seen = (t < 200) | (t >= 600)
    values, off, chosen = alone.standing_in(t, np.where(seen, x, np.nan), 3500.0)
    np.testing.assert_array_equal(values[seen], x[seen])
    np.testing.assert_allclose(values[chosen], x[chosen])
    assert np.isnan(values[~seen & ~chosen]).all()
    assert not chosen[seen].any()
    assert (np.diff(t[chosen]) >= alone.SILENT_S - 4).all()
    assert (t[chosen] > 196 + alone.SILENT_S).all()
    assert (t[chosen] < 600 - alone.SILENT_S).all()
    nearest = np.minimum(np.abs(t - 196), np.abs(t - 600))[~seen]
    np.testing.assert_allclose(off[~seen], 10 * np.maximum(nearest - 15, 0))
    assert (off[seen] == 0).all()


@pytest.mark.parametrize("side", ["before", "after"])
def test_before_the_first_and_after_the_last_the_nearest_stands_in_up_to_what_is_known_of_any(side):
    t = np.arange(0, 1000, 4.0)
    seen = t >= 500 if side == "before" else t < 500
    values, off, chosen = alone.standing_in(t, np.where(seen, 3000 + 5 * t, np.nan), 1000.0)
    assert chosen.sum() in (15, 16)
    assert (values[chosen] == (5500 if side == "before" else 3000 + 5 * 496)).all()
    assert off.max() == 1000.0


def test_of_nothing_nothing_stands_in():
    t = np.arange(0, 100, 4.0)
    values, off, chosen = alone.standing_in(t, np.full(25, np.nan), 50.0)
    assert np.isnan(values).all()
    assert (off == 50.0).all()
    assert not chosen.any()
