"""The memory that the smoother's sweeps work on."""

from __future__ import annotations

import threading
from typing import Any, NamedTuple

import numpy as np

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
