"""Where a channel may be off, before anything is weighed: where it jumps, and from where to where it is off.

A step of a channel after a sample has the score sum of V^-1 (z - E z) over its later readings, by the smoother's
leave-one-out residuals (de Jong and Penzer 1998): one sum from the end on. How large such sums are by chance, the log
itself tells.

For the stretches that begin or end with a jump the readings of the channel are divided into cells about as long as half
the filter's memory, and every cell gets an offset, slope and bend of its own as columns beside one pass of the filter
(`filtering.columns`). From their scores and information follow, by sums over cells, those of a curve over any stretch.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.editing.lasting.curves import CLOCK, Curve, Setting
from ftproc.core.filtering.columns import Columns, said_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.identification.stretches import runs_of
from ftproc.order_statistics import median
from ftproc.records import FloatArray, IntArray

TERMS = 3  # of a cell: offset, slope, bend
BLOCK = 1000  # sums from which their scale is taken
FEWEST, AGREE, BESIDE = (
    3,
    0.75,
    7,
)  # of a rejected run: readings on either side of a step in it, share of them on either
# side of the track, and readings that tell how far they jump
JOINS = 0.3  # times as far off the track at one end of a run as at the other


class Jump(NamedTuple):
    """A step that a station may make before a sample; gain: about what it adds to the log-likelihood. ways: the sets of
    channels (components, or CLOCK) that may make it together."""

    gain: float
    sample: int
    station: int
    ways: tuple[tuple[int, ...], ...]


def sums(log: Observations, smoothed: SmootherRun, setting: Setting, stations: int) -> FloatArray:
    """(stations, 4, n) sums of the smoothations from each sample to the end, of the components and the clock of each
    station, in units of their own scale. smoothed: with the weights of the log."""
    u = np.where(log.weight > 0, smoothed.residual / smoothed.residual_variance, 0.0)
    u = np.where(np.isfinite(u), u, 0.0)
    found = np.zeros((stations, 4, len(u)))
    for s in range(stations):
        own = u if setting.station is None else np.where(setting.station[:, None] == s, u, 0.0)
        found[s, :CLOCK] = own.T
        found[s, CLOCK] = (own * setting.late).sum(1)
    found = found[:, :, ::-1].cumsum(2)[:, :, ::-1]
    return found / _scale(found)


def _scale(values: FloatArray) -> FloatArray:
    """Of values (..., n), by the median of their sizes in blocks, interpolated between their middles."""
    n = values.shape[-1]
    blocks = max(round(n / BLOCK), 1)
    edges = np.linspace(0, n, blocks + 1).astype(int)
    middle = 0.5 * (edges[1:] + edges[:-1])
    size = np.stack([1.4826 * np.median(np.abs(values[..., a:b]), -1) for a, b in itertools.pairwise(edges)], -1)
    flat = size.reshape(-1, blocks)
    typical = np.maximum(flat, 0.2 * np.median(flat, 1, keepdims=True))
    whole = np.stack([np.interp(np.arange(n), middle, each) for each in typical])
    found: FloatArray = np.maximum(whole.reshape(values.shape), 1e-300)
    return found


def steps_of(
    log: Observations, model: Model, starts: list[Start], setting: Setting, channel: tuple[int, int], edges: IntArray
) -> FloatArray:
    """(m,) how much likelier the log becomes with a step of a channel at each of the edges (m + 1,) but the last."""
    said = said_of(log, model, starts, _cells(setting, channel, edges, np.ones((len(setting.time_s), 1))))
    score = said.score[::-1].cumsum()[::-1]
    information = np.diag(said.information[::-1, ::-1].cumsum(0).cumsum(1))[::-1]
    found: FloatArray = 0.5 * score**2 / np.maximum(information, 1e-300)
    return found


def _cells(setting: Setting, channel: tuple[int, int], edges: IntArray, powers: FloatArray) -> Columns:
    """Columns of the powers (n, terms) of time in each cell between edges (m + 1,)."""
    (component, station), n, terms = channel, len(powers), powers.shape[1]
    design = np.zeros((n, 3, terms))
    rows = setting.rows(Curve(component, 0, n, (), station))
    if component == CLOCK:
        design[rows] = setting.late[rows, :, None] * powers[rows, None, :]
    else:
        design[rows, component] = powers[rows]
    begin, end = np.repeat(edges[:-1], terms), np.repeat(edges[1:], terms)
    return Columns(design, begin, end, np.full(len(begin), -1))


def gains(
    log: Observations, model: Model, starts: list[Start], setting: Setting, channel: tuple[int, int], edges: IntArray
) -> FloatArray:
    """(2, m + 1, m + 1) how much likelier the log becomes with a curve of one and of TERMS terms in a channel, from one
    of the edges (m + 1,) to another."""
    t = setting.time_s - setting.time_s[0]
    powers = np.vander(2 * t / max(t[-1], 1e-300) - 1, TERMS, increasing=True)
    return gains_by(log, model, starts, setting, channel, edges, powers)


def gains_by(
    log: Observations,
    model: Model,
    starts: list[Start],
    setting: Setting,
    channel: tuple[int, int],
    edges: IntArray,
    terms: FloatArray,
) -> FloatArray:
    """The same with the first and with all terms (n, k) of any curve."""
    m, k = len(edges) - 1, terms.shape[1]
    said = said_of(log, model, starts, _cells(setting, channel, edges, terms))
    return _from_cells(said.score.reshape(m, k), said.information.reshape(m, k, m, k))


def _from_cells(score: FloatArray, information: FloatArray) -> FloatArray:
    """The gains, from the scores (m, k) and the information (m, k, m, k) of the cells."""
    m, terms = score.shape
    total, both = np.zeros((m + 1, terms)), np.zeros((m + 1, m + 1, terms, terms))
    total[1:] = score.cumsum(0)
    both[1:, 1:] = information.transpose(0, 2, 1, 3).cumsum(0).cumsum(1)
    upper = np.triu_indices(m + 1, 1)
    low, high = upper
    s = total[high] - total[low]
    i = both[high, high] + both[low, low] - both[low, high] - both[high, low]
    scale = np.sqrt(np.maximum(np.einsum("kii->ki", i), 1e-300))
    s, i = s / scale, i / scale[:, :, None] / scale[:, None, :] + 1e-9 * np.eye(terms)
    found = np.zeros((2, m + 1, m + 1))
    found[0][upper] = 0.5 * s[:, 0] ** 2
    found[1][upper] = 0.5 * (s * np.linalg.solve(i, s[:, :, None])[:, :, 0]).sum(1)
    return found


def jumps(found: FloatArray, least: float, most: int, apart: int, together: float) -> list[Jump]:
    """The largest jumps by sums (stations, 4, n), so many samples apart. Together jump the components of at least so
    large a share of the largest gain, or all that there are."""
    gain = 0.5 * found**2
    result: list[Jump] = []
    while len(result) < most:
        s, _, k = (int(i) for i in np.unravel_index(int(gain.argmax()), gain.shape))
        top = float(gain[s, :, k].max())
        if not top > least:
            break
        near = gain[s, :, max(k - 2, 0) : k + 3].max(1)
        result.append(Jump(top, k, s, _ways(near, least, together)))
        gain[s, :, max(k - apart, 0) : k + apart + 1] = 0.0
    return result


def jumps_between(gain: FloatArray, edges: IntArray, least: float, together: float) -> list[Jump]:
    """The largest jump of each channel, where several stations show how large the channels are: gain (stations, 4, m)
    of a step at each edge. The evidence for it does not decrease with the distance."""
    found = []
    for s, c in np.ndindex(gain.shape[:2]):
        k = int(gain[s, c].argmax())
        if gain[s, c, k] > least:
            near = gain[s, :, max(k - 2, 0) : k + 3].max(1)
            found.append(Jump(float(gain[s, c, k]), int(edges[k]), int(s), _ways(near, least, together)))
    return distinct(found)


def beside_runs(weight: FloatArray, possible: NDArray[np.bool_], off: FloatArray, least: float) -> list[Jump]:
    """The steps that rejected runs of a single station may hide, the largest first. off: (n, 3) leave-one-out residuals
    in sigmas of the noise."""
    found: list[Jump] = []
    for c in range(CLOCK):
        seen = np.flatnonzero(possible[:, c])
        for begin, end in runs_of(weight[seen, c] <= 0, 2 * FEWEST):
            for index, size in _within(off[seen[begin:end], c]):
                if 0.5 * size**2 > least and begin + index < len(seen):
                    found.append(Jump(0.5 * size**2, int(seen[begin + index]), 0, ((c,),)))
    return sorted(found, key=lambda jump: -jump.gain)


def _within(off: FloatArray) -> Iterator[tuple[int, float]]:
    """Where, and by how much, the readings of a rejected run may jump for good, from their distances off the track: a
    track that is bent from before a step to after it lies between the two, or joins one of them slowly."""
    n = len(off)
    higher = np.cumsum(np.sign(off))  # readings above the track less those below, up to each
    for index, other in ((int(higher.argmin()) + 1, higher[-1]), (int(higher.argmax()) + 1, -higher[-1])):
        if min(index, n - index) >= FEWEST and 0.5 * (n + other) + abs(higher[index - 1]) >= AGREE * n:
            yield index, median(off[index : index + BESIDE]) - median(off[max(index - BESIDE, 0) : index])
    first, last = median(off[:BESIDE]), median(off[-BESIDE:])
    if abs(last) < JOINS * abs(first):
        yield 0, first
    if abs(first) < JOINS * abs(last):
        yield n, -last


def distinct(jumps: Sequence[Jump]) -> list[Jump]:
    """The jumps, the largest first, and each once."""
    found = {(jump.station, jump.sample, jump.ways): jump for jump in sorted(jumps, key=lambda jump: jump.gain)}
    return sorted(found.values(), key=lambda jump: -jump.gain)


def _ways(near: FloatArray, least: float, together: float) -> tuple[tuple[int, ...], ...]:
    """The sets of channels of a station that may jump where their gains are near (4,)."""
    components = [int(i) for i in np.argsort(-near[:CLOCK]) if near[i] > 0]
    if not components:
        return ()
    large = [i for i in components if near[i] > max(together * near[components[0]], least)]
    alone = [(i,) for i in large or components[:1]]
    together_ = [tuple(sorted(large)), tuple(sorted(components))] if len(large) > 1 else []
    found = [way for way in (*alone, *together_, (CLOCK,)) if near[list(way)].max() > least]
    if len(large) > 1:  # the clock moves them all, and within a large jump of it their rates change
        found.append((CLOCK,))
    return tuple(dict.fromkeys(found))


def spread(edges: Sequence[int], width: int, samples: int) -> IntArray:
    """Edges of cells of about this width, that contain the edges given."""
    marks = sorted({0, samples, *(e for e in edges if 0 <= e <= samples)})
    pieces = [
        np.linspace(a, b, max(round((b - a) / width), 1) + 1).astype(np.int64) for a, b in itertools.pairwise(marks)
    ]
    return np.unique(np.concatenate(pieces))
