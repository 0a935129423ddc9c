"""The memory that the smoother's sweeps work on, and the scores that they find."""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import empty, zeros
from ftproc.core.filtering import backward
from ftproc.core.filtering.filters import (
    COLOURED,
    COLOURED_POSTERIOR,
    COLOURED_UPDATE,
    POSTERIOR,
    UPDATE,
    ColouredFilters,
    ColouredPosteriors,
    ColouredUpdates,
    Filters,
    Posteriors,
    Updates,
)
from ftproc.core.filtering.forward import Estimates, Residuals

FloatArray = NDArray[np.float64]

BLOCK = 1 << 16  # samples whose updates are kept


class Memory(NamedTuple):
    """What a sweep works on: a `filters.Filter`, the filters before each block, the `filters.Update` of each sample of
    a block and its `filters.Posterior`, if that is asked for, and one `backward.Backward`; and what it fills, sample by
    sample of the log."""

    filters: Filters
    before: Filters
    block: Updates
    after: Posteriors
    back: backward.Backwards
    estimates: Estimates
    residuals: Residuals


class ColouredMemory(NamedTuple):
    """The same of a state that ends with the offsets of the measurements."""

    filters: ColouredFilters
    before: ColouredFilters
    block: ColouredUpdates
    after: ColouredPosteriors
    back: backward.ColouredBackwards
    estimates: Estimates
    residuals: Residuals


def memory_of(samples: int, first: Any, estimates: Any, residuals: Any) -> Any:
    """For a span of so many samples that begins with a filter (an array of one record, which is changed)."""
    coloured = first.dtype == COLOURED
    before = empty(first.dtype, -(-samples // BLOCK))
    rows = min(samples, BLOCK)
    block = scratch(COLOURED_UPDATE if coloured else UPDATE, rows)
    after = scratch(COLOURED_POSTERIOR if coloured else POSTERIOR, rows)
    back = zeros(backward.COLOURED if coloured else backward.BACKWARD)
    return (ColouredMemory if coloured else Memory)(first, before, block, after, back, estimates, residuals)


_held = threading.local()


def scratch(layout: np.dtype[np.void], count: int) -> Any:
    """`count` records with whatever they hold, until this thread asks again: memory that the system hands out anew,
    page by page, would cost a sweep a good part of its time."""
    held = getattr(_held, "records", {})
    if layout not in held or len(held[layout]) < count:
        held[layout] = empty(layout, count)
    _held.records = held
    return held[layout][:count]


class Slope(NamedTuple):
    """How the log-likelihood depends on the logarithms of some variances: the sums of what the record says of each,
    and of what it would say on average if the variance were right. Their difference is the score."""

    found: FloatArray
    expected: FloatArray

    @property
    def score(self) -> FloatArray:
        """d log-likelihood / d ln(variance)."""
        return self.found - self.expected

    @property
    def curvature(self) -> FloatArray:
        """Of the log-likelihood, downward, from here to where the two sums are equal, if the second stays as it is and
        the first falls as the variance grows: with it a Newton step goes ln(found / expected) at once."""
        found, expected = np.maximum(self.found, 1e-300), np.maximum(self.expected, 1e-300 * np.maximum(self.found, 1))
        ratio = np.log(found / expected)
        near = np.abs(ratio) < 1e-3
        mean: FloatArray = np.where(near, 0.5 * (found + expected), (found - expected) / np.where(near, 1.0, ratio))
        return mean


class Scores(NamedTuple):
    """The likelihood of a model and its slope: by ln(variance) of the noise and of the offsets (3,), by
    ln(correlation time) of these (3,), and by ln(jerk density) of each axis in each piece of the profile (m, 3)."""

    log_likelihood: float
    noise: Slope
    markov: Slope
    tau: FloatArray
    jerk: Slope
