"""One unscented transform or update by the kernels, on arrays that they may keep; and random problems for it."""

from __future__ import annotations

import numpy as np

from ftproc.core.filtering import ukf
from ftproc.core.model.measurement import innovate
from tests import naive
from tests.core.tracks import covariance


def transform(x, p):
    """z^, C, P_xz and H of the kernel."""
    factor, b, z_hat, h, c = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3))
    pxz = np.zeros((9, 3))
    ukf.linearise(x, p, factor, b, z_hat, h, c)
    ukf.cross_covariance(p, h, pxz)
    return z_hat, c, pxz, h


def update(x, p, z, noise, weight):
    """x+, P+, NIS and log-likelihood of the kernel."""
    x, p = x.copy(), p.copy()
    z_hat, c, pxz, h = transform(x, p)
    e, s, s_inv, gain = np.zeros(3), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((9, 3))
    innovate(z, z_hat, e)
    used = np.where(np.isfinite(e), weight, 0.0)
    return x, p, *ukf.update(x, p, pxz, c, h, e, noise, used, s, s_inv, gain)


def random_problem(rng, spread=0.05):
    """State, covariance, reading and noise; position sigmas up to `spread` of the range."""
    x = np.r_[rng.normal(0, 1, 3) * 10 ** rng.uniform(2, 5), rng.normal(0, 100, 3), rng.normal(0, 10, 3)]
    slant = np.linalg.norm(x[:3])
    p = covariance(rng, np.r_[slant * spread * rng.uniform(0.02, 0.5, 3), rng.uniform(1, 50, 6)])
    noise = np.array([0.01 * slant, 0.01, 0.01]) ** 2 * rng.uniform(0.1, 1, 3)
    z = naive.measure(x) + np.sqrt(noise) * rng.standard_normal(3)
    return x, p, z, noise


def close(found, expected, p, tolerance):
    """States and covariances agree, in units of the 1-sigmas of p."""
    sigma = np.sqrt(np.diag(p))
    np.testing.assert_allclose(found[0] / sigma, expected[0] / sigma, atol=tolerance, rtol=tolerance)
    np.testing.assert_allclose(found[1] / np.outer(sigma, sigma), expected[1] / np.outer(sigma, sigma), atol=tolerance)
