"""Editing of single components, with the numbers of the papers."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import channels, walks

TIME = np.arange(60.0)
RNG = np.random.default_rng(0)


def held(threshold, order=0, window=1, longest=10**6, angular=False):
    return channels.Predictor(order, window, threshold, longest, 1.0, angular)


def gate(z, threshold=0.06, check_first=False, time=TIME, **how):
    z = np.asarray(z, float)
    return channels.gate(time[: len(z)], z, held(threshold, **how), check_first)


# --- the simple gate ----------------------------------------------------------------------------------------------


def test_gate_drops_what_jumps_and_keeps_what_follows():
    np.testing.assert_array_equal(gate([1, 1.05, 3, 1.1, np.nan, 1.15]), [1, 1, 0, 1, 0, 1])


def test_a_wrong_first_reading_locks_the_gate_but_not_the_improved_one():
    z = [5.0] + [1.0 + 0.01 * k for k in range(20)]
    assert gate(z).sum() == 1
    np.testing.assert_array_equal(gate(z, check_first=True), [0, 0] + [1] * 19)


def test_improved_gate_drops_pairs_until_two_agree():
    np.testing.assert_array_equal(gate([9, 1, 7, 1, 1, 1.01, 1.02], check_first=True), [0, 0, 0, 0, 1, 1, 1])


def test_alternating_outliers_cost_the_improved_gate_good_readings():
    z = np.where(np.arange(20) % 2, 5.0 + np.arange(20), 1.0)
    assert gate(z, check_first=True).sum() == 0
    assert gate(z).sum() == 10


def test_threshold_grows_with_the_gap_and_azimuth_is_taken_the_short_way():
    gap = np.array([0.0, 1.0, 4.0])
    assert gate([0, 0.05, 0.2], time=gap).sum() == 3
    assert gate([0, 0.05, 0.24], time=gap).sum() == 2
    assert gate([3.12, -3.14], angular=True).sum() == 2
    assert gate([3.12, -3.14]).sum() == 1


# --- the line through four points ---------------------------------------------------------------------------------


def line(z, threshold=0.6, time=TIME, order=1, window=4, longest=3, angular=False):
    z = np.asarray(z, float)
    return channels.least_squares(time[: len(z)], z, held(threshold, order, window, longest, angular))


def test_weights_of_the_last_four_are_minus_half_nought_half_one():
    for i, weight in enumerate((-0.5, 0.0, 0.5, 1.0)):
        z = np.append(np.eye(4)[i], 1e9)
        assert line(z, threshold=1.5)[0][4] == pytest.approx(weight, abs=1e-12)


@pytest.mark.parametrize("run", [1, 2])
def test_line_replaces_one_or_two_outliers_exactly(run):
    z = 3 + 2 * TIME[:30]
    truth = z.copy()
    z[10 : 10 + run] += 50
    value, weight = line(z)
    np.testing.assert_allclose(value, truth, atol=1e-9)
    np.testing.assert_array_equal(np.flatnonzero(weight == 0), np.arange(10, 10 + run))


def test_three_outliers_in_a_row_are_accepted():
    """The paper's own limit."""
    z = 3 + 0.1 * TIME[:30]
    z[10:13] += 50
    value, weight = line(z)
    assert weight[12] == 1
    assert abs(value[12] - z[12]) < 1e-9


def test_line_uses_the_real_times_and_steps_over_missing_readings():
    time = np.cumsum(RNG.uniform(0.3, 2.0, 40))
    z = 5 - 3 * time
    truth = z.copy()
    z[20], z[25] = 100, np.nan
    value, weight = line(z, time=time)
    np.testing.assert_allclose(np.delete(value, 25), np.delete(truth, 25), atol=1e-9)
    assert np.isnan(value[25])
    assert (weight[20], weight[25]) == (0, 0)


def test_line_follows_an_azimuth_across_the_cut():
    turning = 3.0 + 0.02 * TIME
    z = (turning + np.pi) % (2 * np.pi) - np.pi
    z[30] = 1.0
    value, weight = line(z, threshold=0.1, angular=True)
    np.testing.assert_allclose(value, turning, atol=1e-9)
    assert weight.sum() == 59


# --- the anti-outlier Kalman filter -------------------------------------------------------------------------------


def kalman(z, x0, own_only=False, small_gain=0.002, gate=4.0, order=0, window=1, longest=10**6):
    """With the paper's Q = 0.006, R = 0.002, P0 = 0.01."""
    z = np.asarray(z, float)
    m = z.shape[1]
    p0, noise, gained = np.full(m, 0.01), np.full(m, 0.002), np.full(m, 0.006)
    nought, one = np.zeros(m, np.int64), np.ones(m, np.int64)
    model = walks.Walk(nought, np.asarray(x0, float), p0, noise, gained, order * one, window * one, longest, 1.0)
    return walks.outlier_kalman(TIME[: len(z)], z, model, gate, small_gain, own_only)


def test_from_the_papers_wrong_start_the_gate_opens_at_the_eighth_recursion():
    value, _, _, _, weight = kalman(np.tile([110.712, 33.917], (20, 1)), (109.99, 32.95))
    assert int(np.argmax(weight.all(1))) + 1 == 8
    np.testing.assert_allclose(value[-1], (110.712, 33.917), atol=1e-3)


def test_scaled_gain_has_its_own_covariance():
    """P - K'H P - P H'K'' + K' S K'' in plain numbers, one component off."""
    z = np.array([[0.0, 0.0], [0.01, 5.0], [0.02, 0.0]])
    value, variance, _, sigma, weight = kalman(z, (0, 0))
    x, p = np.zeros(2), np.full(2, 0.01)
    for k in range(3):
        p = p + 0.006
        s = p + 0.002
        e = z[k] - x
        gain = p / s * (0.002 if (np.abs(e) > 4 * np.sqrt(s)).any() else 1.0)
        x, p = x + gain * e, (1 - gain) ** 2 * p + gain**2 * 0.002
        np.testing.assert_allclose(value[k], x, atol=1e-12)
        np.testing.assert_allclose(variance[k], p, rtol=1e-12)
        np.testing.assert_allclose(sigma[k], np.sqrt(s), rtol=1e-12)
    np.testing.assert_array_equal(weight, [[1, 1], [1, 0], [1, 1]])


def test_improved_filter_leaves_the_good_component_its_gain():
    z = np.array([[0.0, 0.0], [0.2, 5.0]])
    joint, own = (kalman(z, (0, 0), own_only)[0][1] for own_only in (False, True))
    assert abs(joint[0]) < 1e-3
    assert own[0] > 0.15
    assert abs(own[1]) < 0.02


@pytest.mark.parametrize("run", [1, 3, 6])
def test_improved_filter_survives_six_outliers_in_a_row(run):
    z = np.tile([110.712, 33.917], (40, 1)) + 0.01 * RNG.standard_normal((40, 2))
    z[15 : 15 + run, 0] += 1.0
    value, _, _, _, weight = kalman(z, z[0], own_only=True)
    assert np.abs(value[1:] - (110.712, 33.917)).max() < 0.05
    np.testing.assert_array_equal(np.flatnonzero(weight[:, 0] == 0), np.arange(15, 15 + run))


@pytest.mark.parametrize("order", [0, 1])
def test_the_second_of_three_components_is_an_azimuth(order):
    """It crosses the cut; a component that did so without being an angle would jump by a full turn."""
    turning = 3.0 + 0.02 * TIME
    z = np.stack([100 + TIME, (turning + np.pi) % (2 * np.pi) - np.pi, 0.01 * TIME], 1)
    value, *_, weight = kalman(z, z[0], own_only=True, gate=30.0, order=order, window=3)
    assert weight[:, 1].all()
    np.testing.assert_allclose(value[3:, 1], turning[3:], atol=0.05)


def test_missing_reading_leaves_the_value_and_widens_it():
    z = np.array([[0.0, 0.0], [np.nan, 0.1], [0.0, np.nan]])
    value, variance, innovation, _, weight = kalman(z, (0, 0))
    assert value[1, 0] == value[0, 0]
    assert variance[1, 0] == pytest.approx(variance[0, 0] + 0.006)
    assert np.isnan(innovation[1, 0])
    assert weight[1, 0] == 0


# --- repaired by a window -----------------------------------------------------------------------------------------


def walk(z, kind=walks.WALK, threshold=5.0, noise=1.0, gained=1.0, time=TIME, order=0, window=10, angular=False):
    z = np.asarray(z, float)
    how = walks.Repair(kind, noise, gained, 0.9, 0.3)
    return walks.repaired_walk(time[: len(z)], z, how, held(threshold, order, window, 16, angular))


@pytest.mark.parametrize("run", [1, 5, 16])
@pytest.mark.parametrize("kind", [walks.WALK, walks.RELIABLE, walks.RELIABLE_LITERAL])
def test_repaired_value_of_a_line_is_exact_for_up_to_sixteen_in_a_row(run, kind):
    z = 300 + 0.5 * TIME
    truth = z.copy()
    z[28 : 28 + run] = 1500
    *_, weight, repaired = walk(z, kind, threshold=300)
    np.testing.assert_allclose(repaired, truth, atol=1e-9)
    np.testing.assert_array_equal(np.flatnonzero(weight == 0), np.arange(28, 28 + run))


def test_seventeenth_in_a_row_re_initializes():
    z = 300 + 0.5 * TIME
    z[28:50] = 1500
    *_, weight, repaired = walk(z, threshold=300)
    assert not weight[28:44].any()
    assert weight[44] == 1
    assert repaired[44] == 1500


def test_weights_of_the_ten_point_extrapolation():
    expected = [-0.2, -0.133, -0.067, 0, 0.067, 0.133, 0.2, 0.267, 0.333, 0.4]
    for i, weight in enumerate(expected):
        *_, repaired = walk(np.append(np.eye(10)[i], np.nan), threshold=5)
        assert repaired[10] == pytest.approx(weight, abs=1e-3)


def test_literal_reliable_filter_gives_back_its_input():
    z = 300 + np.cumsum(RNG.standard_normal(60))
    value, *_ = walk(z, walks.RELIABLE_LITERAL, threshold=50)
    np.testing.assert_array_equal(value, z)


def test_regularised_reliable_filter_smooths_but_less_than_it_follows():
    truth = 377.8 - 15 * np.cos(0.083 * TIME)
    z = truth + 3 * RNG.standard_normal(60)
    value, *_ = walk(z, walks.RELIABLE, threshold=50, noise=9.0)
    error, raw = (np.sqrt(np.mean((v - truth)[10:] ** 2)) for v in (value, z))
    assert error < 0.95 * raw
    assert np.sqrt(np.mean((value - z) ** 2)) < 1.5


def test_walk_is_the_scalar_kalman_filter():
    time = np.cumsum(RNG.uniform(0.5, 2, 60))
    z = np.cumsum(RNG.standard_normal(60))
    value, variance, innovation, sigma, _, _ = walk(z, threshold=1e3, noise=2.0, gained=0.7, time=time)
    x, p = z[0], 2.0
    p = p * 2 / (p + 2)
    for k in range(1, 60):
        p += 0.7 * (time[k] - time[k - 1])
        assert innovation[k] == pytest.approx(z[k] - x)
        assert sigma[k] == pytest.approx(np.sqrt(p + 2))
        gain = p / (p + 2)
        x, p = x + gain * (z[k] - x), (1 - gain) * p
        assert (value[k], variance[k]) == pytest.approx((x, p))


def test_missing_readings_are_repaired_until_they_are_too_many():
    z = 10 + 2 * TIME
    truth = z.copy()
    z[20:50] = np.nan
    *_, weight, repaired = walk(z, threshold=50)
    np.testing.assert_allclose(repaired[20:36], truth[20:36], atol=1e-9)
    assert np.isnan(repaired[36:50]).all()
    assert weight[50] == 1
    assert repaired[50] == truth[50]


def test_walk_follows_an_azimuth_across_the_cut():
    turning = 3.0 + 0.02 * TIME
    value, *_ = walk((turning + np.pi) % (2 * np.pi) - np.pi, threshold=0.5, noise=1e-6, gained=1e-3, angular=True)
    np.testing.assert_allclose(value, turning, atol=2e-3)


# --- about a polynomial -------------------------------------------------------------------------------------------

JITTERED = np.cumsum(RNG.uniform(0.5, 1.5, 40))


@pytest.mark.parametrize("order", [0, 1, 2])
@pytest.mark.parametrize("window", [1, 2, 3, 5, 9])
def test_residuals_are_those_of_a_fitted_polynomial(order, window):
    z = RNG.standard_normal(40)
    z[[4, 20]] = np.nan
    off, gained = channels.residuals(JITTERED, z, channels.Predictor(order, window, 1.0, 1, 1.0, False))
    there = np.flatnonzero(np.isfinite(z))
    for i, k in enumerate(there):
        if i < window or JITTERED[k] - JITTERED[there[i - 1]] > 1.5:
            assert np.isnan(off[k])
            assert np.isnan(gained[k])
            continue
        rows = there[i - window : i]
        fitted = np.polynomial.Polynomial.fit(JITTERED[rows], z[rows], min(order, window - 1))
        expected, before = fitted(JITTERED[k]), fitted(JITTERED[rows[-1]])
        assert off[k] == pytest.approx(z[k] - expected, abs=1e-9)
        assert gained[k] == pytest.approx(z[k] - z[rows[-1]] - (expected - before), abs=1e-9)
    assert np.isfinite(off).sum() >= 40 - 2 * window - 20


def test_a_polynomial_through_few_instants_has_a_lower_degree():
    """Three readings at one instant: their mean, whatever the degree."""
    time, z = np.array([1.0, 1.0, 1.0, 2.0]), np.array([1.0, 2.0, 6.0, 0.0])
    for order in (0, 1, 2):
        off, _ = channels.residuals(time, z, channels.Predictor(order, 3, 1.0, 1, 1.0, False))
        assert off[3] == pytest.approx(-3.0)


def flying(order):
    """A path that a polynomial of this degree follows."""
    return 100 + 40 * TIME + (1.5 * TIME**2 if order == 2 else 0.0)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("check_first", [False, True])
def test_a_flying_target_needs_a_polynomial(order, check_first):
    """Outliers of 30 m, with 40 m and more between readings; degree 0 cannot see them."""
    z = flying(order)
    bad = [20, 21, 22, 40]
    z[bad] += 30
    seen = gate(z, 5.0, check_first, order=order, window=order + 2)
    np.testing.assert_array_equal(np.flatnonzero(seen == 0), bad)
    assert gate(z, 2.0 * np.abs(np.diff(z)).max(), check_first).all()


def test_a_checked_beginning_drops_readings_until_they_agree():
    z = flying(1)
    z[[0, 2]] += 500
    weight = gate(z, 5.0, True, order=1, window=3)
    np.testing.assert_array_equal(np.flatnonzero(weight == 0), [0, 1, 2])
    assert gate(z, 5.0, False, order=1, window=3)[3:6].sum() == 0


def test_so_many_in_a_row_are_the_track():
    z = flying(1)
    z[20:] += 1e6
    for longest in (3, 7):
        kept = gate(z, 5.0, order=1, window=3, longest=longest)
        np.testing.assert_array_equal(np.flatnonzero(kept == 0), np.arange(20, 20 + longest - 1))
        *_, weight = kalman(np.stack([z, z], 1), z[[0, 0]], order=1, window=3, longest=longest)
        np.testing.assert_array_equal(np.flatnonzero(weight[:, 0] == 0), np.arange(20, 20 + longest - 1))


@pytest.mark.parametrize("order", [1, 2])
def test_the_kalman_filter_about_a_polynomial_follows_a_flight(order):
    """The plain walk rejects nearly all of it; about a polynomial a patch is bridged, and what follows is taken."""
    z = np.stack([flying(order), flying(order)], 1)
    truth = z.copy()
    z[30:35, 0] += 15
    value, variance, _, _, weight = kalman(z, z[0], own_only=True, order=order, window=5)
    np.testing.assert_array_equal(np.argwhere(weight == 0), [[k, 0] for k in range(30, 35)])
    np.testing.assert_allclose(value[5:], truth[5:], atol=0.2)
    assert (np.diff(variance[29:36, 0]) > 0)[:5].all()
    plain = kalman(z, z[0], own_only=True)
    assert plain[4].mean() < 0.2


def test_gate_of_the_kalman_filter_opens_with_the_power_of_the_degree():
    """After j intervals without a good reading the variance of its prediction has grown by Q j^(2 order)."""
    z = np.stack([flying(2), flying(2)], 1)
    z[30:36] = np.nan
    for order, power in ((0, 1), (1, 2), (2, 4)):
        _, variance, _, _, _ = kalman(z, z[0], gate=1e6, order=order, window=4)
        gained = variance[30:36, 0] - variance[29, 0]
        np.testing.assert_allclose(gained, 0.006 * np.arange(1, 7.0) ** power, rtol=1e-9)


@pytest.mark.parametrize("kind", [walks.WALK, walks.RELIABLE, walks.RELIABLE_LITERAL])
@pytest.mark.parametrize("order", [1, 2])
def test_repair_about_a_polynomial_is_exact_on_it(kind, order):
    truth = flying(order)
    z = truth.copy()
    z[30:38] += 150
    z[45] = np.nan
    value, *_, weight, repaired = walk(z, kind, 10.0, order=order, window=6)
    np.testing.assert_array_equal(np.flatnonzero(weight == 0), [*range(30, 38), 45])
    np.testing.assert_allclose(repaired, truth, atol=1e-6)
    np.testing.assert_allclose(value, truth, atol=1e-6)


def test_good_readings_after_a_long_patch_do_not_bend_the_polynomial():
    """The flight has turned in the meantime; the first good reading is taken, and those that follow."""
    truth = np.where(TIME < 33, 40 * TIME, 40 * 33 + 43 * (TIME - 33))
    z = truth + 0.3 * RNG.standard_normal(60)
    z[30:37] += 400
    *_, weight, _ = walk(z, threshold=12.0, order=1, window=6)
    np.testing.assert_array_equal(np.flatnonzero(weight == 0), np.arange(30, 37))


@pytest.mark.parametrize("order", [0, 1, 2])
def test_the_unit_of_time_does_not_matter(order):
    """Thresholds and variances are those of one interval, whatever it lasts."""
    z = 3 * RNG.standard_normal(60) + 100
    z[20:24] += 40
    z[[30, 31]] = np.nan
    time = np.cumsum(RNG.uniform(0.6, 1.4, 60))
    found = []
    for unit in (1.0, 0.05):
        how = channels.Predictor(order, order + 3, 12.0, 16, unit, False)
        whole = np.full(2, order), np.full(2, order + 3)
        model = walks.Walk(np.zeros(2, np.int64), z[[0, 0]], *np.full((3, 2), 9.0), *whole, 16, unit)
        both = np.stack([z, z], 1)
        found.append([
            *walks.repaired_walk(unit * time, z, walks.Repair(walks.WALK, 9.0, 9.0, 0.9, 0.3), how),
            *walks.outlier_kalman(unit * time, both, model, 4.0, 0.002, True),
            *channels.least_squares(unit * time, z, how),
            channels.gate(unit * time, z, how, True),
        ])  # fmt: skip
    for one, other in zip(*found, strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-6, atol=1e-6)
