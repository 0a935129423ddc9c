"""What the smoother's backward recursion gives besides the states: leave-one-out residuals and scores."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import backward
from ftproc.core.filtering.forward import ESTIMATED
from ftproc.core.filtering.memory import Slope
from ftproc.core.filtering.records import Model
from ftproc.core.filtering.smoother import score_log, smooth_log
from ftproc.core.model import motion
from tests import naive
from tests.core.single import one
from tests.core.tracks import matched

STRAIGHT = {"distance": 1e6, "sigma": np.array([0.1, 1e-7, 2e-7])}  # so far and so exact that h is almost straight


def smooth(a, **changes):
    a = a._replace(**changes)
    return smooth_log(a.log, a.model, a.starts)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_leave_one_out_is_deletion_from_the_joint_gaussian(seed):
    """Used, partly weighted, barred and missing readings; irregular times; several jerk pieces."""
    a = matched(seed, 14, dt=0.5, q=5.0, irregular=True, missing=0.15, pieces=2, distance=2e5)
    weight = np.random.default_rng(seed).choice([0.0, 0.3, 1.0, 1.0], a.weight.shape)
    steps = naive.run(a.time, a.z, weight, a.model, a.starts[0].state, a.starts[0].covariance)
    residual, variance = naive.leave_one_out(steps, a.z, weight, a.model.noise_variance)
    found = smooth(a, weight=weight)
    np.testing.assert_array_equal(np.isnan(found.residual), np.isnan(a.z))
    np.testing.assert_allclose(found.residual / np.sqrt(variance), residual / np.sqrt(variance), atol=5e-6)
    np.testing.assert_allclose(found.residual_variance, variance, rtol=1e-7)


def test_leave_one_out_is_deletion_of_the_reading():
    """The same with the filter run again without the reading. It is then linearised a little elsewhere."""
    a = matched(4, 30, dt=0.5, **STRAIGHT)
    full = smooth(a)
    for k in range(0, 30, 3):
        for c in range(3):
            weight = a.weight.copy()
            weight[k, c] = 0.0
            without = smooth(a, weight=weight)
            sigma = np.sqrt(full.residual_variance[k, c])
            assert full.residual[k, c] / sigma == pytest.approx(without.residual[k, c] / sigma, abs=2e-4)
            assert full.residual_variance[k, c] == pytest.approx(without.residual_variance[k, c], rel=2e-4)


def test_leave_one_out_residuals_are_standard_normal_for_a_matched_model():
    t = []
    for seed in range(8):
        a = matched(10 + seed, 300, q=20.0)
        found = smooth(a)
        t.append(found.residual / np.sqrt(found.residual_variance))
    assert np.mean(np.square(t)) == pytest.approx(1, abs=0.04)
    assert 0.001 < np.mean(np.abs(t) > 3) < 0.005


def test_outlier_does_not_hide_in_its_own_residual():
    a = matched(5, 60)
    z = a.z.copy()
    z[30, 1] += 50 * np.sqrt(a.model.noise_variance[1])
    found, clean = smooth(a, z=z), smooth(a)
    t = found.residual / np.sqrt(a.model.noise_variance)
    assert t[30, 1] - (clean.residual / np.sqrt(a.model.noise_variance))[30, 1] == pytest.approx(50, rel=1e-3)


def likelihood(a, model):
    return smooth(a, model=model).log_likelihood


@pytest.mark.parametrize("weighted", [False, True])
def test_noise_score_is_the_derivative_of_the_likelihood(weighted):
    a = matched(6, 300, irregular=True, missing=0.1, pieces=2, **STRAIGHT)
    if weighted:
        a = a._replace(weight=a.weight * np.random.default_rng(0).choice([0.0, 0.2, 1.0], a.weight.shape))
    score = score_log(a.log, a.model, a.starts).noise.score
    for c in range(3):
        step = np.zeros(3)
        step[c] = 1e-3
        numeric = np.diff([likelihood(a, moved(a.model, noise=sign * step)) for sign in (-1, 1)])[0] / 2e-3
        assert score[c] == pytest.approx(numeric, rel=1e-4, abs=1e-4)


def moved(model, noise=0.0, jerk=0.0):
    return model._replace(noise_variance=model.noise_variance * np.exp(noise), jerk=model.jerk * np.exp(jerk))


@pytest.mark.compiled
def test_jerk_score_is_the_derivative_by_every_axis_of_every_piece():
    a = matched(7, 200, dt=0.5, q=5.0, irregular=True, missing=0.1, pieces=3, **STRAIGHT)
    score = score_log(a.log, a.model, a.starts).jerk.score
    assert score.shape == (3, 3)
    for piece in range(3):
        for axis in range(3):
            step = np.zeros((3, 3))
            step[piece, axis] = 1e-4
            numeric = np.diff([likelihood(a, moved(a.model, jerk=sign * step)) for sign in (-1, 1)])[0] / 2e-4
            assert score[piece, axis] == pytest.approx(numeric, rel=5e-4, abs=1e-4), (piece, axis)


def test_of_the_two_sums_of_a_score_the_second_is_what_the_first_is_on_average():
    found = [score_log(a.log, a.model, a.starts) for a in (matched(seed, 200, q=5.0) for seed in range(40, 80))]
    for name in ("noise", "jerk"):
        sums = np.array([getattr(each, name) for each in found]).mean(0)
        np.testing.assert_allclose(sums[0], sums[1], rtol=0.1)


def test_curvature_of_a_single_variance_leads_to_its_summit_at_once():
    """n errors of variance v, if w is assumed: found n v / (2 w), expected n / 2."""
    n, v = 50, 7.0
    for w in (1e-3, 1.0, 6.999, 7.0, 1e4):
        slope = Slope(np.array([0.5 * n * v / w]), np.array([0.5 * n]))
        assert slope.score[0] / slope.curvature[0] == pytest.approx(np.log(v / w), rel=1e-3, abs=1e-9)


def test_scores_of_a_log_in_two_parts_add_up():
    a = matched(8, 300, irregular=True, missing=0.1)
    again = a.starts[0]._replace(sample=140, state=a.truth[140])
    both = score_log(a.log, a.model, [a.starts[0], again])
    first = score_log(a.log.part(slice(140)), a.model, a.starts)
    rest = score_log(a.log.part(slice(140, None)), a.model, [again._replace(sample=0)])
    for name in ("noise", "jerk"):
        np.testing.assert_allclose(getattr(both, name), np.add(getattr(first, name), getattr(rest, name)), rtol=1e-10)
    assert both.log_likelihood == pytest.approx(smooth(a, starts=[a.starts[0], again]).log_likelihood, rel=1e-12)


@pytest.mark.compiled
def test_scores_vanish_on_average_at_the_truth():
    """Expectation zero, and a variance that is the information: about n / 2 for ln(variance) of each component."""
    scores = np.array(
        [score_log(a.log, a.model, a.starts).noise.score for a in (matched(seed, 200, q=5.0) for seed in range(40, 80))]
    )
    assert np.abs(scores.mean(0)).max() < 3 * np.sqrt(100 / 40)
    assert (scores.var(0) < 200).all()
    assert (scores.var(0) > 30).all()


@pytest.mark.compiled
def test_likelihood_is_highest_near_the_true_noise_and_jerk():
    a = matched(9, 800, q=10.0)
    best = likelihood(a, a.model)
    for factor in (0.25, 4.0):
        for c in range(3):
            noise = a.model.noise_variance.copy()
            noise[c] *= factor
            assert likelihood(a, a.model._replace(noise_variance=noise)) < best - 20
    for factor in (1e-3, 1e3):
        assert likelihood(a, Model(a.model.noise_variance, motion.isotropic(10 * factor))) < best - 5


def test_a_sigma_is_a_number_even_where_the_covariance_is_none():
    back, row = one(backward.BACKWARD), one(ESTIMATED)
    back["state"], back["cov"] = np.arange(1.0, 10.0), np.diag([-1.0, *np.ones(8)])
    backward.keep(back, row)
    np.testing.assert_allclose(row["sigma"], [0.0, *np.ones(8)])
