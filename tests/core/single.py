"""One unscented transform or update by the kernels, on one record; and random problems for it."""

from __future__ import annotations

import numpy as np

from ftproc.core.compiled import WAY, zeros
from ftproc.core.filtering import ukf, unscented
from ftproc.core.filtering.filters import FILTER
from ftproc.core.filtering.records import SAMPLE
from tests import naive
from tests.core.tracks import covariance


def one(layout):
    """A record of zeros for `part`s that a test calls; where those are plain Python its fields are attributes."""
    records = zeros(layout)
    return records[0] if WAY == "jit" else records.view(np.recarray)[0]


def filter_at(x, p):
    """The record of a filter in this state."""
    f = one(FILTER)
    f["x"], f["p"] = x, p
    return f


def sample_of(z, noise, weight=1.0, late=0.0):
    """The record of a reading."""
    sample = one(SAMPLE)
    sample["measurement"], sample["noise"], sample["weight"], sample["late"] = z, noise, weight, late
    return sample


def transform(x, p):
    """z^, C, P_xz and H of the kernel."""
    f = filter_at(x, p)
    unscented.linearise(f)
    ukf.cross_covariance(f["p"], f["h"], f["pxz"])
    return f["z_hat"], f["c"], f["pxz"], f["h"]


def update(x, p, z, noise, weight, late=0.0):
    """x+, P+, NIS and log-likelihood of the kernel; the last two of an update that uses nothing mean nothing."""
    f = filter_at(x, p)
    unscented.linearise(f)
    ukf.cross_covariance(f["p"], f["h"], f["pxz"])
    ukf.innovate(sample_of(z, noise, late=late), f)
    ukf.use(weight, f)
    return f["x"], f["p"], *ukf.update(f)


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
