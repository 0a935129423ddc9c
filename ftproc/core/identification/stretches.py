"""Stretches of a log: runs of samples, and several of them in one log, each with a start of its own, so that one sweep
serves all."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.filtering.initialization import find_starts
from ftproc.core.filtering.records import Observations, Start

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]


def runs_of(flag: NDArray[np.bool_], shortest: int = 1) -> IntArray:
    """(m, 2) begin and end of each run of true in (n,) that is not shorter."""
    framed = np.zeros(len(flag) + 2, bool)
    framed[1:-1] = flag
    edges: IntArray = np.flatnonzero(framed[1:] != framed[:-1]).reshape(-1, 2)
    return edges[edges[:, 1] - edges[:, 0] >= shortest]


def widened(marked: NDArray[np.bool_], around: int) -> NDArray[np.bool_]:
    """(n,) true within so many samples of what is marked."""
    edges = np.zeros(len(marked) + 1, int)
    for begin, end in runs_of(marked):
        edges[max(begin - around, 0)] += 1
        edges[min(end + around, len(marked))] -= 1
    return np.cumsum(edges)[:-1] > 0


class Stretches(NamedTuple):
    """samples: (m,) of the whole log, in order. log, starts: of these alone."""

    samples: IntArray
    log: Observations
    starts: list[Start]


def stretches_of(
    log: Observations, spans: Iterable[slice], noise_variance: FloatArray, jerk_psd: float
) -> Stretches | None:
    """Stretches of a log that do not overlap, in order; None if nothing is left of them.

    Left out are the samples before the first start of each, and stretches in which a component has no good reading.
    noise_variance, jerk_psd: see `find_starts`.
    """
    chosen, found, count = list[IntArray](), list[Start](), 0
    for span in spans:
        try:
            inside = find_starts(log.part(span), noise_variance, jerk_psd)
        except ValueError:
            continue
        first = inside[0].sample
        found += [start._replace(sample=count + start.sample - first) for start in inside]
        chosen.append(np.arange(span.start + first, span.stop))
        count += len(chosen[-1])
    if not found:
        return None
    samples = np.concatenate(chosen)
    return Stretches(samples, log.part(samples), found)
