"""Rejected readings, each alone and on a curve of their own, against plain numpy."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from ftproc.core.editing import patch_likelihood

RATES = np.array([0.05, 0.01, 0.9])
SIGMA = 0.3


def said(residual, time=None, weight=None, sigma=SIGMA, rates=RATES):
    """What the kernel makes of residuals that are all rejected, unless weights say otherwise."""
    n = len(residual)
    time = 0.1 * np.arange(n) if time is None else time
    weight = np.zeros(n) if weight is None else weight
    return patch_likelihood.log_probability(
        time, np.asarray(residual, float), np.full(n, sigma**2), weight, sigma, rates
    )


def unrelated(off, scale):
    return np.log(np.sqrt(2 * np.pi) / (np.pi * scale * (1 + (off / scale) ** 2)))


def on_a_curve(time, residual, sigma, lone):
    """The same by orthogonal polynomials from a QR decomposition and numpy's least squares."""
    n = len(residual)
    basis = np.linalg.qr(np.vander(time - time.mean(), 3, increasing=True))[0] * np.sqrt(n)
    fit = np.full(n, np.sort(residual)[n // 2])
    for weighted in [True] * patch_likelihood.ROUNDS + [False] * patch_likelihood.ROUNDS:
        off = np.abs(residual - fit)
        near = max(patch_likelihood.OFF_CURVE * sigma, 2.5 * np.sort(off)[n // 2])
        root = np.sqrt(1 / np.maximum(off, sigma) if weighted else off <= near)
        coefficient = np.linalg.lstsq(basis * root[:, None], residual * root, rcond=None)[0]
        fit = basis @ coefficient
    inside = np.abs(residual - fit) <= patch_likelihood.OFF_CURVE * sigma
    k = inside.sum()
    good = np.log(1 - lone) - np.log(sigma) - 0.5 * ((residual - fit)[inside] / sigma) ** 2
    off_curve = np.log(lone) + unrelated((residual - fit)[~inside], patch_likelihood.WIDE * sigma)
    occam = np.log(sigma / np.sqrt(k)) + unrelated(coefficient, patch_likelihood.WIDE * sigma)
    return good.sum() + off_curve.sum() + occam.sum()


@pytest.mark.parametrize("seed", range(20))
def test_a_patch_by_plain_numpy(seed):
    rng = np.random.default_rng(seed)
    n = int(rng.integers(7, 40))
    time = np.cumsum(rng.uniform(0.02, 0.2, n))
    residual = 8 * SIGMA + 0.5 * (seed % 3) * (time - time[0]) + SIGMA * rng.standard_normal(n)
    lone = rng.random(n) < 0.1
    residual[lone] += 30 * rng.standard_normal(lone.sum())
    apart = unrelated(residual, np.hypot(SIGMA, patch_likelihood.WIDE * SIGMA)).sum()
    together = on_a_curve(time, residual, SIGMA, RATES[0])
    expected = np.logaddexp(apart, together) - np.log(2) + np.log(RATES[1]) + n * np.log(RATES[2])
    assert said(residual, time) == pytest.approx(expected, abs=1e-8)


def test_lone_readings_are_unrelated():
    residual = np.array([0.1, 9.0, 0.0, -4.0, 5.0, 0.2])
    expected = sum(np.log(RATES[0]) + unrelated(r, np.hypot(SIGMA, 25 * SIGMA)) for r in (9.0, -4.0, 5.0))
    assert said(residual, weight=np.array([1.0, 0, 1, 0, 0, 1])) == pytest.approx(expected, abs=1e-10)
    assert said(residual, weight=np.ones(6)) == 0.0


def test_the_density_of_the_unrelated_is_one():
    whole, _ = quad(lambda off: np.exp(patch_likelihood._unrelated(off, 2.0)) / np.sqrt(2 * np.pi), -np.inf, np.inf)
    assert whole == pytest.approx(1.0, abs=1e-8)


def test_what_is_on_a_curve_is_likelier_than_what_is_not_at_almost_any_distance():
    rng = np.random.default_rng(5)
    noise = SIGMA * rng.standard_normal(25)
    near, far, scattered = (said(offset + noise) for offset in (8 * SIGMA, 200 * SIGMA, 40 * SIGMA * noise))
    assert near - scattered > 50
    assert 0 < near - far < 5


def test_most_must_be_on_the_curve():
    rng = np.random.default_rng(6)
    scattered = 100 * SIGMA * rng.standard_normal(30)
    scattered[::3] = 20 * SIGMA
    apart = unrelated(scattered, np.hypot(SIGMA, 25 * SIGMA)).sum()
    assert said(scattered) == pytest.approx(apart - np.log(2) + np.log(RATES[1]) + 30 * np.log(RATES[2]), abs=1e-9)


@pytest.mark.parametrize("n", [3, 4, 12])
def test_readings_of_one_instant_make_a_constant(n):
    residual = 9 * SIGMA + SIGMA * np.cos(np.arange(n))
    assert np.isfinite(said(residual, time=np.full(n, 7.0)))


def test_huge_numbers_do_no_harm():
    assert np.isfinite(said(np.array([1e12, -1e12, 1e12, 3.0, 1e-300])))


def test_of_all_components_is_the_sum_of_each():
    """Of readings that may be good at all, each with noise and rates of its own."""
    rng = np.random.default_rng(3)
    n, noise, rates = 60, np.array([9.0, 1e-8, 4e-8]), np.stack([RATES, 0.5 * RATES, 0.9 * RATES])
    time = np.cumsum(rng.uniform(0.02, 0.2, n))
    residual, variance = 6 * np.sqrt(noise) * rng.standard_normal((n, 3)), noise * rng.uniform(1, 2, (n, 3))
    weight, possible = (rng.random((n, 3)) > 0.4).astype(float), rng.random((n, 3)) > 0.2
    weight[20:35, 1] = 0.0
    of_all = patch_likelihood.log_probability_of_all(time, residual, variance, weight, possible, noise, rates)
    each = [
        patch_likelihood.log_probability(
            time[seen], residual[seen, c], variance[seen, c], weight[seen, c], np.sqrt(noise[c]), rates[c]
        )
        for c, seen in enumerate(possible.T)
    ]
    assert of_all == pytest.approx(sum(each), rel=1e-12)
