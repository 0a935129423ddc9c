"""The weight of a reading, from its normalised innovation: the two fuzzy systems of Shao et al. 2020 (their
tables 2 and 3, figures 3 and 4), and the chi-square quantiles on which their edges rest.

A normalised innovation rho of m readings is small (S) up to the 75 % point of chi-square with m degrees of freedom,
medium (M) about the 99 % point and big (B) from the 99.99 % point on, with straight lines between, so that the three
memberships add up to one. Rules join them: AND is the minimum, the output the average of the rules' answers weighted
by how far each applies.
"""

from __future__ import annotations

from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

EDGES = (0.75, 0.99, 0.9999)  # probabilities of the corners of the memberships
READING_RULES = np.array([1.0, 0.5, 0.0])  # for rho = S, M, B
MEMBER_RULES = np.array(  # rows rho of the members' mean, columns of the member itself
    [[1.0, 1.0, 0.5],
     [0.5, 0.5, 0.0],
     [0.0, 0.0, 0.0]]
)  # fmt: skip


@cache
def chi_square_quantile(probability: float, freedom: int) -> float:
    """The value that chi-square with `freedom` degrees of freedom does not exceed with this probability."""
    from scipy.special import chdtri  # loaded by these filters only

    return float(chdtri(freedom, 1 - probability))


def memberships(rho: ArrayLike, freedom: int) -> FloatArray:
    """(..., 3) how far each rho is small, medium and big; they add up to one."""
    first, second, third = (chi_square_quantile(p, freedom) for p in EDGES)
    rho = np.asarray(rho, float)
    small = np.clip((second - rho) / (second - first), 0.0, 1.0)
    big = np.clip((rho - second) / (third - second), 0.0, 1.0)
    return np.stack([small, 1 - small - big, big], -1)


def trust_in_reading(rho: float, freedom: int) -> float:
    """gamma_f in [0, 1] of a whole reading: 0 leaves the prediction as it is."""
    return float(memberships(rho, freedom) @ READING_RULES)


def trust_in_members(rho_mean: float, rho: FloatArray, freedom: int) -> FloatArray:
    """(n,) gamma_s in [0, 1]: how far the reading may weigh on each member, whose rho is (n,)."""
    applies = np.minimum(memberships(rho_mean, freedom)[:, None], memberships(rho, freedom)[:, None, :])
    trust: FloatArray = (applies * MEMBER_RULES).sum((1, 2)) / applies.sum((1, 2))
    return trust
