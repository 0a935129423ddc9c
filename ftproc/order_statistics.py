"""Order statistics, without what numpy's functions load and do besides: those alone import masked arrays."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SOME = 4_000  # values, of which the median of many more may be taken


def median(values: NDArray[Any]) -> float:
    """Of all values; NaN if one of them is, or there are none."""
    if not values.size:
        return float("nan")
    middle = [(values.size - 1) // 2, values.size // 2, values.size - 1]  # NaN comes last
    low, high, last = np.partition(values, middle, axis=None)[middle].tolist()
    return float(0.5 * (low + high)) if last == last else float("nan")


def medians(values: NDArray[Any]) -> NDArray[Any]:
    """(m,) of the columns of values (n, m), n > 0; NaN where one of them is."""
    low, high, last = (len(values) - 1) // 2, len(values) // 2, len(values) - 1
    ordered = np.partition(values, [low, high, last], axis=0)
    return np.where(np.isnan(ordered[last]), np.nan, 0.5 * (ordered[low] + ordered[high]))


def typical(values: NDArray[Any]) -> float:
    """About the median of values (n,): that of some thousands spread evenly."""
    return median(values[:: 1 + len(values) // SOME])


def quantile(values: NDArray[Any], share: float) -> float:
    """The number below which a share of the values (n,) lie, n > 0, between two of them in proportion; NaN if one of
    them is."""
    rank = share * (len(values) - 1)
    near = [int(rank), min(int(rank) + 1, len(values) - 1), len(values) - 1]
    low, high, last = np.partition(values, near)[near].tolist()
    return float(low + (rank - near[0]) * (high - low)) if last == last else float("nan")


def distinct(values: NDArray[Any]) -> NDArray[Any]:
    """The values (n,) in order, each once."""
    ordered = np.sort(values)
    first = np.ones(len(ordered), bool)
    np.not_equal(ordered[1:], ordered[:-1], out=first[1:])
    return ordered[first]
