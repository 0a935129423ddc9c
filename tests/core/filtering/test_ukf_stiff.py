"""Updates whose prior dwarfs the noise, and very many updates: P stays symmetric and positive definite."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.core.filtering import forward
from ftproc.core.filtering.records import Model, Observations, Start, empty_rows
from ftproc.core.model import motion
from ftproc.core.model.measurement import measure
from tests import naive
from tests.core.single import transform, update
from tests.core.tracks import PATTERNS, SIGMA, covariance


def stiff_problem(rng, ratio, needle=False):
    """A far target whose prior variance is `ratio` times that of the noise, in every component.

    needle: the position is known to 100 m in some direction and to 0.1 m across it.
    """
    x = np.r_[rng.normal(0, 1, 3), np.zeros(6)]
    x[:3] *= 1e9 / np.linalg.norm(x[:3])
    p = covariance(rng, np.r_[np.full(3, 0.1 if needle else 100.0), np.full(3, 30.0), np.full(3, 5.0)])
    if needle:
        direction = rng.standard_normal(3)
        direction *= 100 / np.linalg.norm(direction)
        p[:3, :3] += np.outer(direction, direction)
    c = transform(x, p)[1]
    return x, p, np.array(measure(*x[:3])), np.diag(c) / ratio


def least_eigenvalue(p):
    sigma = np.sqrt(np.diag(p))
    return np.linalg.eigvalsh(p / np.outer(sigma, sigma)).min()


def test_stiff_update_is_the_plain_formula_where_that_is_accurate():
    rng = np.random.default_rng(9)
    for _ in range(20):
        x, p, z, noise = stiff_problem(rng, 3e7)
        found = update(x, p, z, noise, np.ones(3))[1]
        plain = naive.update(x, p, naive.unscented(x, p), z, noise, np.ones(3))[1]
        sigma = np.sqrt(np.diag(p))
        np.testing.assert_allclose(found / np.outer(sigma, sigma), plain / np.outer(sigma, sigma), atol=1e-8)


@pytest.mark.parametrize("used", [p for p in PATTERNS if any(p)])
def test_stiff_update_leaves_the_noise_of_the_readings(used):
    rng = np.random.default_rng(10)
    on = np.flatnonzero(used)
    for _ in range(20):
        x, p, z, noise = stiff_problem(rng, 1e12)
        _, c, _, h = transform(x, p)
        updated = update(x, p, z, noise, np.array(used, float))[1]
        assert least_eigenvalue(updated) > 0
        bend = np.diag(c - h @ p[:3, :3] @ h.T)
        np.testing.assert_allclose(np.diag(h @ updated[:3, :3] @ h.T)[on], (noise + bend)[on], rtol=0.01)


@pytest.mark.parametrize("ratio", [1e8, 1e10, 1e11, 1e13])
def test_stiff_update_of_a_needle_stays_positive(ratio):
    """P - K Pxz' does not: it makes one in a hundred, a quarter and two thirds of the first three indefinite. P - U'U
    alone does but for the last, where the Joseph form is needed."""
    rng = np.random.default_rng(11)
    for _ in range(200):
        x, p, z, noise = stiff_problem(rng, ratio, needle=True)
        assert least_eigenvalue(update(x, p, z, noise, np.ones(3))[1]) > 0


@pytest.mark.compiled
def test_covariance_stays_positive_over_a_million_steps():
    n = 100_000
    time = 0.05 * np.arange(n)
    turn = 2 * np.pi * time / 61.7
    z = np.stack([np.full(n, 4000.0), (turn + np.pi) % (2 * np.pi) - np.pi, np.full(n, 0.3)], 1)
    z[::7, 0] = np.nan
    z[3::11, 1] = np.nan
    samples = Observations(time, z, np.isfinite(z).astype(float)).samples(SIGMA**2)
    model = Model(SIGMA**2, motion.isotropic(5.0))
    state = np.r_[4000 * np.cos(0.3), 0, 4000 * np.sin(0.3), np.zeros(6)]
    filters = model.filter(Start(0, state, np.diag(np.repeat([10.0, 500.0, 60.0], 3) ** 2)))
    profile, rows, x, p = model.profile(time), empty_rows(n), filters["x"][0], filters["p"][0]
    for _ in range(10):
        forward.run_weighted(forward.Span(0, n, 0), samples, profile, filters, False, rows)
        x[:3] = x[:3] / np.linalg.norm(x[:3]) * 4000
        sigma = np.sqrt(np.diag(p))
        np.testing.assert_array_equal(p, p.T)
        assert np.linalg.eigvalsh(p / np.outer(sigma, sigma)).min() > 1e-6
