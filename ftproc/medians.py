"""The median of numbers, without what numpy's loads and does besides: that alone imports masked arrays."""

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


def typical(values: NDArray[Any]) -> float:
    """About the median of values (n,): that of some thousands spread evenly."""
    return median(values[:: 1 + len(values) // SOME])
