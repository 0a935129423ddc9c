"""Patches between two jumps, and curves and jumps that are none."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing.jump_patches import LONGEST, SHORTEST, SIDE, find


def record(seed=0, n=400):
    """time and a noisy reading of sigma 1 along a gentle cubic."""
    t = 0.1 * np.arange(n)
    return t, 500 + 3 * t - 0.2 * t * t + 2e-3 * t**3 + np.random.default_rng(seed).standard_normal(n)


def found(t, z, good=None, sigma=1.0):
    flag = find(t, z, np.isfinite(z).astype(float) if good is None else good, sigma)
    return np.flatnonzero(flag)


@pytest.mark.parametrize("seed", range(10))
def test_clean_record_has_none(seed):
    assert len(found(*record(seed))) == 0


@pytest.mark.parametrize("size", [12.0, -30.0, 1e4])
@pytest.mark.parametrize("length", [SHORTEST, 10, 30, LONGEST - 2])
def test_offset_is_found_to_the_reading(length, size):
    t, z = record(1)
    z[200 : 200 + length] += size
    np.testing.assert_array_equal(found(t, z), np.arange(200, 200 + length))


def test_step_that_stays_and_lone_spike_are_none():
    t, z = record(2)
    step = z.copy()
    step[200:] += 20
    spike = z.copy()
    spike[200] += 20
    assert len(found(t, step)) == 0
    assert len(found(t, spike)) == 0


def test_turn_without_jumps_is_none():
    t, z = record(3)
    bump = 40 * np.exp(-(((t - 20) / 1.5) ** 2))
    assert len(found(t, z + bump)) == 0


def test_patch_longer_than_looked_for_is_left():
    t, z = record(4)
    z[150 : 150 + LONGEST + 10] += 20
    assert len(found(t, z)) == 0


def test_missing_and_barred_readings_are_stepped_over():
    t, z = record(5)
    z[200:215] += 25
    z[[204, 190, 230]] = np.nan
    good = np.isfinite(z).astype(float)
    good[[207, 195]] = 0.0
    z[195] = 1e6
    np.testing.assert_array_equal(found(t, z, good), np.setdiff1d(np.arange(200, 215), [204, 207]))


@pytest.mark.parametrize("n", [0, 1, SIDE, 2 * SIDE, 2 * SIDE + SHORTEST])
def test_short_records(n):
    assert len(found(0.1 * np.arange(n), np.zeros(n))) == 0


def test_duplicate_times():
    t, z = record(6)
    t = np.repeat(t[::2], 2)
    z[200:210] += 25
    np.testing.assert_array_equal(found(t, z), np.arange(200, 210))
    assert len(found(np.zeros(400), z)) == 0
