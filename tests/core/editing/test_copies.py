"""Readings that were not measured: every way of copying, and instruments that only look like it."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing.copies import COMPUTED, HELD, INTERPOLATED, MEASURED, rounding_step, without_copies

N, DT = 600, 0.1
TIME = DT * np.arange(N)


def readings(seed=0, noise=1.0):
    """A target that climbs away, with noise."""
    draw = np.random.default_rng(seed)
    path = np.stack([9000 + 60 * TIME + 2 * TIME**2, 1e-3 * TIME, 0.1 + 2e-3 * TIME], 1)
    return path + noise * np.array([2.0, 3e-4, 3e-4]) * draw.standard_normal((N, 3))


def rounded(z):
    return np.stack([np.round(z[:, 0], 2), np.round(z[:, 1], 6), np.round(z[:, 2], 6)], 1)


@pytest.mark.parametrize("to", [lambda z: z, rounded])
def test_every_fifth_held(to):
    z = to(readings())
    z[:, 1:] = z[np.arange(N) // 5 * 5, 1:]
    found, kind = without_copies(TIME, z)
    held = np.arange(N) % 5 > 0
    assert (kind[:, 0] == MEASURED).all()
    for c in (1, 2):
        assert np.mean((kind[:, c] == HELD) != held) < 0.01  # two fresh readings may be equal by chance
    np.testing.assert_array_equal(np.isnan(found), kind > 0)
    np.testing.assert_array_equal(found[kind == 0], z[kind == 0])


def test_some_held_at_random():
    draw = np.random.default_rng(5)
    fresh = np.r_[True, draw.random(N - 1) > 0.4]
    z = readings()[np.maximum.accumulate(np.where(fresh, np.arange(N), 0))]
    _, kind = without_copies(TIME, z)
    np.testing.assert_array_equal(kind, np.tile(np.where(fresh, MEASURED, HELD)[:, None], 3))


@pytest.mark.parametrize("to", [lambda z: z, rounded])
@pytest.mark.parametrize("every", [2, 5])
def test_interpolated_between_rows(every, to):
    z, knots = readings(), np.arange(0, N, every)
    z = to(np.stack([np.interp(TIME, TIME[knots], z[knots, c]) for c in range(3)], 1))
    found, kind = without_copies(TIME, z)
    there = np.zeros(N, bool)
    there[knots] = True
    wrong = (kind == MEASURED) != there[:, None]
    assert wrong[:-every].mean() < 0.02  # two lines that go on as one, and the end of the log
    np.testing.assert_array_equal(found[kind == 0], z[kind == 0])
    assert (kind[~there][:-every] != HELD).all()


@pytest.mark.parametrize("gaps", [1, 3])
def test_gaps_that_a_line_fills_do_not_make_an_instrument_slow(gaps):
    """A few readings on lines, exactly as between rows, are left to the editing of outliers."""
    z = readings()
    for first in 60 * np.arange(1, gaps + 1):
        near = slice(first, first + 10)
        z[near] = np.stack(
            [np.interp(TIME[near], TIME[[first, first + 9]], z[[first, first + 9], c]) for c in range(3)], 1
        )
    _, kind = without_copies(TIME, z)
    assert (kind == MEASURED).all()


def test_knots_between_rows_are_moved_onto_the_curve_through_them():
    """A curve that is seen every 0.63 s, on lines in between."""
    own = np.arange(0.0, 61.0, 0.63)

    def curve(t):
        return 9000 + 60 * t + 40 * np.sin(t)

    z = readings()
    z[:, 0] = np.interp(TIME, own, curve(own))
    found, kind = without_copies(TIME, z)
    used = kind[:, 0] == MEASURED
    used[0] = used[-8:] = False  # an end is kept as it is
    assert used.sum() == pytest.approx(60.0 / 0.63, abs=5)
    off, raw = (np.abs(each[used, 0] - curve(TIME[used])).max() for each in (found, z))
    assert off < 0.3 * raw
    assert raw > 0.4


@pytest.mark.parametrize("seed", range(5))
def test_fresh_readings_are_left_as_they_are(seed):
    for z in (readings(seed), rounded(readings(seed)), readings(seed, noise=0.1)):
        z[::37] = np.nan
        found, kind = without_copies(TIME, z)
        assert not kind.any()
        np.testing.assert_array_equal(found, z)


def test_a_target_that_stands_is_not_held():
    """Rounded readings of a target at rest repeat by chance, or all the time where the noise is below the rounding."""
    draw = np.random.default_rng(6)
    for noise, step in ((1.0, 0.5), (0.05, 1.0)):
        z = np.tile(5000.3 + noise * draw.standard_normal((N, 1)), 3)
        assert not without_copies(TIME, step * np.round(z / step))[1].any()


def test_a_coarse_instrument_that_sees_a_slow_target_is_not_held():
    z = np.tile((5000 + 0.8 * TIME + 0.1 * np.random.default_rng(7).standard_normal(N))[:, None], 3)
    assert not without_copies(TIME, np.round(z))[1].any()


def test_a_component_that_is_stuck_once_is_an_outlier():
    z = readings()
    z[200:230, 0] = z[200, 0]
    assert not without_copies(TIME, z)[1].any()


def test_few_or_constant_readings():
    for z in (np.full((N, 3), 3.0), np.full((N, 3), np.nan), readings()[:3], readings()[:0]):
        assert not without_copies(TIME[: len(z)], z)[1].any()


def test_copies_of_rows_at_the_same_time_are_held():
    z, time = np.repeat(readings()[:300], 2, 0), np.repeat(TIME[:300], 2)
    assert (without_copies(time, z)[1][1::2] == HELD).all()
    assert INTERPOLATED not in without_copies(time, z)[1]


def coasting(z, begin, end, curved=0.0):
    """The readings of a tracker that goes on by itself there, with the rates of the second before."""
    z, k = z.copy(), np.arange(begin, end)
    rate = (z[begin - 1] - z[begin - 11]) / (TIME[begin - 1] - TIME[begin - 11])
    late = (TIME[k] - TIME[begin - 1])[:, None]
    z[k] = z[begin - 1] + rate * late + curved * np.array([1.0, 1e-4, 1e-4]) * late**2
    return z


@pytest.mark.parametrize("to", [lambda z: z, rounded])
@pytest.mark.parametrize("curved", [0.0, 0.5])
@pytest.mark.parametrize(("begin", "end"), [(540, 600), (200, 240), (300, 320)])
def test_a_tracker_that_coasts_has_no_noise(begin, end, curved, to):
    """Also a component that hardly changes meanwhile, as long as another one does."""
    found, kind = without_copies(TIME, to(coasting(readings(1), begin, end, curved)))
    inside = np.zeros(N, bool)
    inside[begin:end] = True
    assert (kind[inside] == COMPUTED).mean() > 0.95
    assert (kind[~inside] != MEASURED).sum() <= 6
    assert np.isnan(found[kind > 0]).all()


@pytest.mark.parametrize("noise", [1e-3, 1.0])
def test_a_target_that_rests_a_while_is_measured(noise):
    """However little noise there is then, and however little there is at all."""
    z = readings(2, noise)
    z[250:350] = z[250] + 1e-2 * (z - readings(2, 0.0))[250:350]
    assert (without_copies(TIME, z)[1] == MEASURED).all()
    slow = 0.98 ** np.abs(np.arange(N)[:, None] - np.arange(N)) @ np.random.default_rng(3).standard_normal((N, 3))
    assert (without_copies(TIME, readings(4, 0.0) + slow * np.array([2.0, 3e-4, 3e-4]))[1] == MEASURED).all()


@pytest.mark.parametrize("far", [1e6, 1e12, -1e12])
def test_the_rounding_shows_beside_a_reading_that_is_none(far):
    z = rounded(readings())
    z[7] = far
    assert [rounding_step(channel) for channel in z[:, 1:].T] == pytest.approx([1e-6, 1e-6])
    _, kind = without_copies(TIME, z)
    assert not kind.any()


@pytest.mark.parametrize("step", [1.5, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("share", [0.02, 0.05])
def test_coarse_readings_among_outliers_are_no_lines(step, share):
    """Whose rounding is coarser than their noise: nearly three in a row lie on a line, and outliers do not."""
    draw, sigma = np.random.default_rng(8), np.array([2.0, 3e-4, 3e-4])
    z = readings(6)
    off = draw.random(z.shape) < share
    z = np.round(np.where(off, z + draw.uniform(10, 100, z.shape) * sigma, z) / (step * sigma)) * step * sigma
    assert (without_copies(TIME, z)[1] == INTERPOLATED).mean() < 0.01
