"""The first look: least-median parabolas against the best of all triples; planted outliers; stuck readings."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.editing import screening
from ftproc.core.editing.screening import bar_runs, screen_component, stuck
from ftproc.core.model.frames import wrap
from tests import naive


def flagged(time, z, window=31, angular=False):
    return screen_component(time, z, window, angular, 0.0)[0] > 0.5


def parabola(n, dt=0.1):
    t = dt * np.arange(n)
    return t, 3000 + 80 * t - 2 * t * t


def test_scale_is_that_of_the_best_parabola_through_three_samples():
    """Windows of five: ten triples, nearly all of which are tried."""
    rng = np.random.default_rng(1)
    exact = 0
    for _ in range(60):
        t, z = np.cumsum(rng.uniform(0.5, 2, 5)), rng.standard_normal(5)
        best = naive.least_median_parabola(t, z)
        scale = screen_component(t, z, 5, False, 0.0)[1][0] / (1.4826 * (1 + 5 / 2))
        assert scale >= best * (1 - 1e-9) - 1e-12
        exact += scale <= best * (1 + 1e-9) + 1e-12
    assert exact >= 55


def test_clean_parabola_with_noise_is_left_alone():
    rng = np.random.default_rng(2)
    share = []
    for _ in range(20):
        t, z = parabola(400)
        share.append(flagged(t, z + rng.standard_normal(400)).mean())
    assert np.mean(share) < 0.005
    assert max(share) < 0.02


def test_scales_tell_the_noise():
    rng = np.random.default_rng(3)
    t, z = parabola(2000)
    scales = screen_component(t, z + 5 * rng.standard_normal(2000), 31, False, 0.0)[1]
    assert np.median(scales) == pytest.approx(5, rel=0.3)


@pytest.mark.parametrize(("share", "least"), [(0.05, 0.97), (0.2, 0.97), (0.4, 0.85)])
def test_planted_outliers_are_found(share, least):
    """At 40 % one window in eight holds more bad readings than good ones."""
    rng = np.random.default_rng(4)
    found, false = [], []
    for _ in range(5):
        t, z = parabola(600)
        bad = rng.random(600) < share
        z = z + rng.standard_normal(600)
        z[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(15, 200, bad.sum())
        flag = flagged(t, z)
        found.append(flag[bad].mean())
        false.append(flag[~bad].mean())
    assert np.mean(found) > least
    assert np.mean(false) < 0.02


def test_the_parabola_near_most_of_a_window_is_that_of_least_squares_through_what_is_left():
    rng = np.random.default_rng(8)
    t, good = np.sort(rng.uniform(0, 3, 31)), np.ones(31, bool)
    z = 500 + 40 * t - 9 * t**2 + 2.0 * rng.standard_normal(31)
    good[[4, 5, 17, 30]] = False
    z[~good] += [60, -90, 500, 40]
    residual, work = np.empty(31), np.empty(62)
    scale = screening._near_most(t, z, 31, False, 2.0, residual, work)
    kept = work[31:] > 0
    through = np.polyfit(t[kept], z[kept], 2)
    assert not (kept & ~good).any()
    assert kept.sum() >= 26
    np.testing.assert_allclose(residual, z - np.polyval(through, t), atol=1e-9)
    assert scale == pytest.approx(np.sqrt((residual[kept] ** 2).sum() / (kept.sum() - 3)), rel=1e-9)
    for worse, typical in ((z, 0.1), (z, 0.0), (np.where(t > 1.5, z + 80, z), 2.0), (np.full(31, 7.0), 1.0)):
        assert (worse[0] == 7.0) != np.isinf(screening._near_most(t, worse, 31, False, typical, residual, work))
    assert np.isinf(screening._near_most(np.ones(31), z, 31, False, 2.0, residual, work))


def test_a_long_log_is_screened_as_its_stretches_are():
    """Most of its windows are not searched."""
    rng = np.random.default_rng(3)
    t = 0.1 * np.arange(6000)
    z, bad = 3000 * np.sin(0.05 * t) + 4.0 * rng.standard_normal(6000), rng.random(6000) < 0.05
    z[bad] += rng.choice([-1, 1], bad.sum()) * rng.uniform(8, 300, bad.sum()) * 4.0
    votes, scales = screen_component(t, z, 31, False, 0.0)
    apart = np.concatenate(
        [screen_component(t[k : k + 600], z[k : k + 600], 31, False, 0.0)[0] for k in range(0, 6000, 600)]
    )
    assert ((votes > 0.5) != (apart > 0.5)).mean() < 0.005
    assert (votes[bad] > 0.5).mean() > 0.985
    assert (votes[~bad] > 0.5).mean() < 0.002
    assert np.median(scales) == pytest.approx(4.0, rel=0.05)


def test_patch_of_a_third_of_the_long_window_is_found():
    rng = np.random.default_rng(5)
    t, z = parabola(400)
    z = z + rng.standard_normal(400)
    z[200:225] += 60
    assert flagged(t, z, window=75)[200:225].mean() > 0.9
    assert flagged(t, z, window=75)[:190].mean() < 0.02


def test_azimuth_across_the_cut():
    rng = np.random.default_rng(6)
    t = 0.1 * np.arange(500)
    z = wrap(np.pi - 0.3 + 0.012 * t + 1e-4 * rng.standard_normal(500))
    bad = rng.random(500) < 0.1
    assert np.ptp(z) > 6
    assert flagged(t, z, angular=True).mean() < 0.01
    z[bad] = wrap(z[bad] + 0.01)
    assert flagged(t, z, angular=True)[bad].all()


def test_hovering_at_the_cut():
    """Noise makes the azimuth of a target straight behind the station jump to and fro by a whole turn."""
    rng = np.random.default_rng(13)
    t = 0.1 * np.arange(300)
    z = wrap(np.pi + 1e-4 * rng.standard_normal(300))
    z[[40, 170]] = wrap(z[[40, 170]] + 0.002)
    votes, scales = screen_component(t, z, 31, True, 0.0)
    assert scales.max() < 3e-4
    assert (votes[[40, 170]] > 0.5).all()
    assert (votes > 0.5).sum() < 5


def test_missing_readings_are_stepped_over():
    rng = np.random.default_rng(7)
    t, z = parabola(300)
    z = z + rng.standard_normal(300)
    z[100] += 100
    z[rng.random(300) < 0.4] = np.nan
    z[100] = 1e4
    flag = flagged(t, z)
    assert flag[100]
    assert not flag[np.isnan(z)].any()
    seen = np.isfinite(z)
    np.testing.assert_array_equal(flag[seen], flagged(t[seen], z[seen]))


@pytest.mark.parametrize("readings", [0, 1, 4])
def test_too_few_readings_are_not_judged(readings):
    z = np.full(20, np.nan)
    z[:readings] = 1.0
    votes, scales = screen_component(np.arange(20.0), z, 31, False, 0.0)
    assert not votes.any()
    assert len(scales) == 0


def test_duplicate_times_do_no_harm():
    rng = np.random.default_rng(8)
    t, z = parabola(200)
    t, z = np.repeat(t, 2), np.repeat(z, 2) + rng.standard_normal(400)
    z[[50, 51, 300]] += 80
    flag = flagged(t, z)
    assert flag[[50, 51, 300]].all()
    assert flag.mean() < 0.03
    votes, scales = screen_component(np.zeros(40), rng.standard_normal(40), 31, False, 0.0)
    assert not votes.any()  # all at one instant: no parabola, but a scatter
    assert ((scales > 0.5) & (scales < 2)).all()


@pytest.mark.parametrize(
    ("votes", "near", "weight"),
    [
        ("..xxxx..", "........", "11111111"),  # a curve
        ("..xxxx..", "..j.....", "11000011"),  # jumps in
        ("..xxxx..", "......j.", "11000011"),  # jumps out
        ("..xx....", "........", "11001111"),  # too short for a curve
        ("xxxxxxxx", "........", "11111111"),
        ("xxxxxxxx", ".......j", "00000000"),
        (".xxx..xx", ".j......", "10001100"),
        ("........", "jjjjjjjj", "11111111"),
    ],
)
def test_runs_that_are_outvoted_need_a_jump(votes, near, weight):
    found = np.ones(len(votes))
    outvoted, jumps = np.array([float(v == "x") for v in votes]), np.array([float(v == "j") for v in near])
    bar_runs(np.zeros(len(votes)), outvoted, jumps, found)
    assert "".join(str(int(w)) for w in found) == weight


def test_missing_readings_do_not_cut_a_run():
    channel, votes, near, weight = np.zeros(20), np.zeros(20), np.zeros(20), np.ones(20)
    votes[3:18], near[[3, 17]] = 1.0, 1.0
    channel[[7, 13]], votes[[7, 13]] = np.nan, 0.0  # between them a piece without a jump of its own
    bar_runs(channel, votes, near, weight)
    np.testing.assert_array_equal(np.flatnonzero(weight == 0), [3, 4, 5, 6, 8, 9, 10, 11, 12, 14, 15, 16, 17])


def test_stuck_readings_are_found_but_the_first():
    z = 1000 + 1.5 * np.arange(200) + np.random.default_rng(9).standard_normal(200)
    z[50:60] = z[49]
    np.testing.assert_array_equal(np.flatnonzero(stuck(z, 1.0)), np.arange(50, 60))
    with_gap = z.copy()
    with_gap[53] = np.nan
    np.testing.assert_array_equal(np.flatnonzero(stuck(with_gap, 1.0)), [50, 51, 52, 54, 55, 56, 57, 58, 59])


def test_chance_pair_is_not_stuck():
    z = 1000 + 1.5 * np.arange(200) + np.random.default_rng(10).standard_normal(200)
    z[50] = z[49]
    assert not stuck(z, 1.0).any()


@pytest.mark.parametrize("step", [0.5, 1.0, 3.0, 10.0])
def test_coarse_rounding_is_not_stuck(step):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        z = np.round((1000 + 0.05 * np.arange(2000) + rng.standard_normal(2000)) / step) * step
        assert not stuck(z, 1.0).any()


def test_long_run_of_a_rounded_reading_is_stuck():
    rng = np.random.default_rng(11)
    z = np.round((1000 + 3.0 * np.arange(1000) + rng.standard_normal(1000)) / 0.5) * 0.5
    z[500:530] = z[499]
    assert stuck(z, 1.0)[500:530].all()


def test_sample_and_hold_is_not_stuck():
    """Each reading repeated five times: sampled faster than measured."""
    z = np.repeat(1000 + 0.3 * np.arange(100) + np.random.default_rng(12).standard_normal(100), 5)
    assert not stuck(z, 1.0).any()
    once = z[::5].copy()
    once[50:55] = once[50]
    assert stuck(once, 1.0).sum() == 4  # that many repeats, if they come alone, are stuck


@pytest.mark.parametrize("z", [[], [1.0], [1.0, 1.0], [np.nan] * 5, [2.0] * 50])
def test_stuck_of_next_to_nothing(z):
    assert not stuck(np.array(z), 1.0).any()


def test_the_outcome_does_not_hang_on_where_in_memory_the_scratch_lies():
    """Three of five readings lie on the best parabola to the last digit, so that how the others' residuals are rounded
    decides about them; compiled loops over arrays that lie close together round in another way."""
    time, reading = (
        np.array([0, 0, 0, 13.600000000000001, 23.200000000000003]),
        np.array([5000.0, 4804.0, 5000.0, 30855.0, 30855.0]),
    )
    draw, found = np.random.default_rng(0), set()
    for _ in range(3000):
        left_behind = [np.ones(size) for size in draw.integers(1, 40, draw.integers(1, 30))]
        del left_behind
        votes, scales = screen_component(time.copy(), reading.copy(), 11, False, 0.0)
        found.add(votes.tobytes() + scales.tobytes())
    assert len(found) == 1


@pytest.mark.parametrize("angular", [False, True])
def test_readings_of_one_instant_scatter_about_their_median(angular):
    reading = np.pi + 1e-3 * np.random.default_rng(1).standard_normal(11)
    reading[4] += 0.5
    votes, (scale,) = screen_component(np.full(11, 7.0), wrap(reading) if angular else reading, 11, angular, 0.0)
    off = np.abs(reading - np.median(reading))
    assert scale == pytest.approx(1.4826 * (1 + 5 / 8) * np.median(off), rel=1e-9)
    assert votes[4] == 1.0
    assert (np.delete(votes, 4) == 0).all()
