"""Interacting multiple models against the textbook, with all matrices and one model at a time."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.comparators import imm
from ftproc.core.filtering import forward
from tests import naive
from tests.core.tracks import matched, position_error

SOJOURN = 5.0


def run(a, jerk):
    return imm.filter_log(a.log, a.model, a.starts, imm.Jumps(jerk, SOJOURN))


def plain(a, jerk):
    """States, 1-sigmas and probabilities, step by step (Bar-Shalom, Li and Kirubarajan 2001, section 11.6.6)."""
    m = len(jerk)
    mu, expected = np.full(m, 1 / m), np.full(m, 1 / m)
    xs, ps = [a.starts[0].state] * m, [a.starts[0].covariance] * m
    out = []
    for k in range(len(a.time)):
        if k:
            t = a.time[k] - a.time[k - 1]
            stay = np.exp(-t / SOJOURN)
            chain = np.full((m, m), (1 - stay) / (m - 1))
            np.fill_diagonal(chain, stay)
            expected = mu @ chain
            share = chain * mu[:, None] / expected
            x0 = [sum(share[i, j] * xs[i] for i in range(m)) for j in range(m)]
            p0 = [
                sum(share[i, j] * (ps[i] + np.outer(xs[i] - x0[j], xs[i] - x0[j])) for i in range(m)) for j in range(m)
            ]
            phi = naive.transition(t)
            xs = [phi @ x for x in x0]
            ps = [phi @ p @ phi.T + naive.van_loan(t, q) for p, q in zip(p0, jerk, strict=True)]
        done = [
            naive.update(x, p, naive.unscented(x, p), a.z[k], a.model.noise_variance, a.weight[k])
            for x, p in zip(xs, ps, strict=True)
        ]
        xs, ps = [d[0] for d in done], [(d[1] + d[1].T) / 2 for d in done]
        mu = expected * np.exp([d[3] for d in done])
        mu /= mu.sum()
        x = sum(w * v for w, v in zip(mu, xs, strict=True))
        p = sum(w * (c + np.outer(v - x, v - x)) for w, v, c in zip(mu, xs, ps, strict=True))
        out.append((x, np.sqrt(np.diag(p)), mu))
    return (np.array(part) for part in zip(*out, strict=True))


def test_run_is_that_of_the_textbook():
    a = matched(2, 60, irregular=True, missing=0.3)
    jerk = np.array([0.1, 1.0, 10.0])[:, None] * a.model.jerk
    found, probability = run(a, jerk)
    state, sigma, mu = plain(a, jerk)
    np.testing.assert_allclose((found.state - state) / sigma, 0, atol=1e-6)
    np.testing.assert_allclose(found.sigma, sigma, rtol=1e-6)
    np.testing.assert_allclose(probability, mu, atol=1e-6)


def test_equal_models_are_one_filter():
    a = matched(3, 100, missing=0.2)
    found, probability = run(a, np.repeat(a.model.jerk, 3, 0))
    single = forward.filter_log(a.log, a.model, a.starts)
    np.testing.assert_allclose((found.state - single.state) / single.sigma, 0, atol=1e-6)
    np.testing.assert_allclose(found.innovation_sigma, single.innovation_sigma, rtol=1e-6)
    np.testing.assert_allclose(found.nis, single.nis, rtol=1e-5, atol=1e-5)
    assert found.log_likelihood == pytest.approx(single.log_likelihood, rel=1e-7)
    np.testing.assert_allclose(probability, 1 / 3, atol=1e-9)


def test_manoeuvre_raises_the_probability_of_hard_jerk_and_the_gain_pays():
    a = matched(5, 400, q=1e-4)
    late = a.time > 20
    push = np.zeros((400, 3))
    push[late, 1] = 20 * (a.time[late] - 20) ** 2  # 4 g from here on
    position = a.truth[:, :3] + push
    z = np.array([naive.measure(p) for p in position]) + (a.z - np.array([naive.measure(p) for p in a.truth]))
    truth = a.truth.copy()
    truth[:, :3] = position
    a = a._replace(z=z, truth=truth)
    found, probability = run(a, np.array([1e-2, 1.0, 1e4])[:, None] * a.model.jerk)
    single = forward.filter_log(a.log, a.model, a.starts)
    assert probability[150:200, 2].mean() < 0.25
    assert probability[205:225, 2].max() > 0.9
    mean = [np.mean(position_error(r.state, truth)[200:260]) for r in (found, single)]
    assert mean[0] < 0.5 * mean[1]
