"""Do published sigmas hold: errors in units of their sigmas, with bounds that allow for errors that are correlated."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ftproc.records import FloatArray

NEES_FACTORS = (1 / 3, 5 / 3)  # of what is expected: so far the mean NEES may be off, as no model is better
LEAST_IN_3SIGMA, LOWEST_IN_3SIGMA = 0.97, 0.9  # of a long flight, and of a short one whose errors are few
MOST_SIGMAS = 12.0  # of the error of a single row
NORMAL_99, NORMAL_ABOVE_99 = 2.576, 2.326  # two-sided and upper 99 % points
OUTSIDE_3SIGMA = math.erfc(3 / math.sqrt(2))  # share of Gaussian errors
MOST_ROWS = 50_000  # whose correlations are computed; of more, every few
WINDOW = 2.0  # correlation times, up to which a correlation is summed

_OVER = "overconfident in "


@dataclass(frozen=True)
class Consistency:
    """Of one quantity, over the rows that have an error and sigmas.

    share_in_3_sigma: of rows with all axes inside. largest_sigma, largest_sigma_time_s: the largest error of any axis
    in sigmas, and its time. nees: mean over the rows of the sum of (error / sigma)^2 over the axes, their number when
    the sigmas are consistent; correlations between the axes are not published and so not used. nees_low, nees_high:
    within which 99 % of consistent flights lie whose errors are as correlated as these, and at least a third to five
    thirds of the number of axes. sigma_verdict: `consistent`, `cautious`, or `overconfident in` these axes.
    """

    share_in_3_sigma: float
    largest_sigma: float
    largest_sigma_time_s: float
    nees: float
    nees_low: float
    nees_high: float
    sigma_verdict: str


def consistency(time_s: FloatArray, ratio: FloatArray, axes: Sequence[str]) -> Consistency | None:
    """From times (n,) and errors over their sigmas (n, axes), NaN where either is not known; None without any."""
    known = np.isfinite(ratio).all(1)
    if not known.any():
        return None
    time_s, ratio = time_s[known], ratio[known]
    row, axis = np.unravel_index(np.abs(ratio).argmax(), ratio.shape)
    freedom = degrees_of_freedom(ratio)
    low, high = nees_bounds(freedom, len(axes))
    share, nees = float((np.abs(ratio) <= 3).all(1).mean()), float((ratio**2).sum(1).mean())
    largest = float(abs(ratio[row, axis]))
    if nees > high or share < least_share(freedom, len(axes)):
        verdict = _OVER + _largest((ratio**2).mean(0), axes)
    elif largest > MOST_SIGMAS:
        verdict = _OVER + _largest((ratio**2).max(0), axes)
    else:
        verdict = "cautious" if nees < low else "consistent"
    return Consistency(share, largest, float(time_s[row]), nees, low, high, verdict)


def _largest(square: FloatArray, axes: Sequence[str]) -> str:
    """The axes whose squares are the largest, or nearly."""
    return ", ".join(axis for axis, size in zip(axes, square, strict=True) if size >= 0.8 * square.max())


def in_words(judged: Sequence[Consistency]) -> str | None:
    """The sigmas of several quantities together: consistent only if all are; None without any."""
    axes = [c.sigma_verdict.removeprefix(_OVER) for c in judged if c.sigma_verdict.startswith(_OVER)]
    if axes:
        return _OVER + ", ".join(axes)
    words = {c.sigma_verdict for c in judged}
    return None if not words else "cautious" if "cautious" in words else "consistent"


def degrees_of_freedom(ratio: FloatArray) -> float:
    """Of the sum of the squares of errors over sigmas (n, m): how many independent Gaussian ones vary as much.

    With the correlations R_ab(j) of axes a and b over j rows, the mean over n rows of the sum of squares has variance
    2/n sum_ab sum_j (1 - |j|/n) R_ab(j)^2 (Isserlis); n m of white independent errors. Correlations beyond WINDOW
    correlation times are noise and left out (Sokal).
    """
    ratio = ratio[:: 1 + (len(ratio) - 1) // MOST_ROWS]
    n, m = ratio.shape
    length = 1 << (2 * n - 1).bit_length()
    size = np.sqrt((ratio**2).mean(0))
    scaled = ratio / np.where(size > 0, size, 1.0)
    spectrum = np.fft.rfft(scaled, length, axis=0)
    found = np.zeros(n)
    for a, b in itertools.product(range(m), repeat=2):
        found += (np.fft.irfft(spectrum[:, a] * np.conj(spectrum[:, b]), length)[:n] / n) ** 2
    found /= 1 - np.arange(n) / n
    total = 2 * np.cumsum(found) - found[0]
    enough = np.arange(n) >= WINDOW * total / max(found[0], np.finfo(float).tiny)
    summed = total[int(enough.argmax())] if enough.any() else total[-1]
    return float(n * m**2 / summed) if summed > 0 else float(n * m)


def nees_bounds(freedom: float, axes: int) -> tuple[float, float]:
    """Of the mean NEES with so many degrees of freedom in all: 99 % of consistent flights (chi-square by Wilson and
    Hilferty's cube root), but at least NEES_FACTORS of the number of axes."""
    share = 2 / (9 * freedom)
    low, high = (max(1 - share + sign * NORMAL_99 * math.sqrt(share), 0.0) ** 3 for sign in (-1, 1))
    return axes * min(low, NEES_FACTORS[0]), axes * max(high, NEES_FACTORS[1])


def least_share(freedom: float, axes: int) -> float:
    """Of rows inside 3 sigma, that 99 % of consistent flights with so many degrees of freedom have (about Poisson), or
    LEAST_IN_3SIGMA where more have it."""
    rows = max(freedom / axes, 1.0)
    expected = rows * (1 - (1 - OUTSIDE_3SIGMA) ** axes)
    outside = (expected + NORMAL_ABOVE_99 * math.sqrt(expected) + 1) / rows
    return min(LEAST_IN_3SIGMA, max(1 - outside, LOWEST_IN_3SIGMA))
