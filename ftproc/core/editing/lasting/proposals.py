"""What a jump of some channels may be: a step that stays, or one end of a patch of a few terms."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from ftproc.core import odds
from ftproc.core.editing.lasting import scan
from ftproc.core.editing.lasting.curves import Curve
from ftproc.core.editing.lasting.weighing import Scene
from ftproc.core.filtering.records import Model
from ftproc.records import FloatArray, IntArray

Channels = Sequence[tuple[int, int]]

SPANS, APART, MOST_SPANS = 2, 3, 4  # stretches on either side of a jump, cells between them, and all that are weighed
TERMS = (1, 2, 3, 5)
LONGEST, FARTHEST = 0.5, 5000  # of the log, and samples: what is off for longer is off for good
LONGEST_AT_END = 0.3  # of the log, at one of its ends: on one side alone a longer curve may as well be motion
END, SHARE = 48, 0.1  # samples at either end, or share of a short log, in which a step may as well be a patch
CELLS, SHORTEST = 200, 3  # cells of a scan, and samples that are off
TRIED = 13  # samples about a jump, where it is not yet known to the sample


class LocatedJump(NamedTuple):
    """A jump of channels (component, station) before a sample of a scene. marks: samples of all jumps. width: of a
    cell, in samples. at_median: the model with the median process noise beside
    the jump."""

    channels: Channels
    sample: int
    marks: Sequence[int]
    width: int
    at_median: Model
    longest: float = LONGEST


def cell_of(width: int, n: int) -> int:
    """Samples in a cell of a scan beside a jump, where those of all of a flight of n would be too wide: a scan costs
    the square of its columns, three for each sample of two cells where an end is looked for."""
    return int(np.clip(width, min(n, 2 * FARTHEST) // CELLS, 2 * FARTHEST // CELLS))


def proposals(scene: Scene, located: LocatedJump) -> Iterator[list[Curve]]:
    """The curves, of one for each channel, that the jump may be."""
    n, at = len(scene.possible), located.sample
    yield from steps(scene, located.channels, at)
    reach = min(int(located.longest * n), FARTHEST)
    here = slice(max(at - reach, 0), min(at + reach, n))
    part, length = scene.part(here), min(at + reach, n) - max(at - reach, 0)
    near = located._replace(sample=at - here.start)
    marks = [near.sample, *(mark - here.start for mark in located.marks if abs(mark - at) > 2 * located.width)]
    edges = scan.spread(marks, max(located.width, length // CELLS), length)
    for more, edge in _likeliest_spans(gains_of(part, located, edges), edges, near.sample):
        other = edge if more else other_end(part, near, edge, located.width, more)
        begin, end = here.start + min(near.sample, other), here.start + max(near.sample, other)
        for terms in TERMS:
            if (terms > 1) != more or end - begin < SHORTEST:
                continue
            if terms == 1 or (terms <= (end - begin) // 4 and not is_one_sided(begin, end, n)):
                yield [Curve(c, begin, end, (0.0,) * terms, s) for c, s in located.channels]


def near_end(n: int) -> int:
    """Samples at either end of a log of n that are too few to tell of what lies before them."""
    return 1 + min(END, int(SHARE * n))


def is_one_sided(begin: int, end: int, n: int) -> bool:
    """Whether a curve has a track on one of its sides alone, and is too long for that."""
    return end - begin > LONGEST_AT_END * n and min(begin, n - end) < near_end(n)


def steps(scene: Scene, channels: Channels, sample: int) -> list[list[Curve]]:
    """Steps that stay, before a sample; which side is right, other stations show."""
    n = len(scene.possible)
    later = [Curve(c, sample, n, (0.0,), s) for c, s in channels]
    return [later, [curve._replace(begin=0, end=sample) for curve in later]] if len(scene.rates) > 1 else [later]


def _likeliest_spans(gain: FloatArray, edges: IntArray, sample: int) -> list[tuple[bool, int]]:
    """Whether more than one term is needed, and the other end, of the likeliest stretches that begin or end with a
    sample; gain: see `scan.gains`."""
    k, found = int(np.searchsorted(edges, sample)), list[tuple[float, bool, int]]()
    for more, side in itertools.product((False, True), (slice(1, max(k - 1, 1)), slice(k + 2, len(edges) - 1))):
        along = _from(gain[int(more)], k) - odds.LIKELIER * more * (scan.TERMS - 1)
        found += [(float(along[j]), more, int(edges[j])) for j in _peaks(along, side)]
    return [(more, edge) for _, more, edge in sorted(found, reverse=True)[:MOST_SPANS]]


def _from(gain: FloatArray, k: int) -> FloatArray:
    """Gains (m + 1,) of the stretches between one edge and each other one, from those of all (m + 1, m + 1)."""
    found: FloatArray = np.where(np.arange(len(gain)) > k, gain[k], gain[:, k])
    return found


def _peaks(values: FloatArray, inside: slice) -> Iterator[int]:
    """The indices of the largest values of a part, well apart."""
    left = np.zeros(len(values))
    left[inside] = values[inside]
    for _ in range(SPANS):
        j = int(left.argmax())
        if not left[j] > 0:
            return
        yield j
        left[max(j - APART, 0) : j + APART + 1] = 0.0


def gains_of(
    part: Scene, located: LocatedJump, edges: IntArray, of_one: Callable[..., FloatArray] = scan.gains
) -> FloatArray:
    """The gains, as `of_one` has them of one, of all channels of a jump, as if each were off alone."""
    whole = [Curve(c, 0, len(part.possible), (), s) for c, s in located.channels]
    log = part.log._replace(weight=part.taking_in(whole))
    starts = part.starts(log)
    found: FloatArray = np.sum(
        [of_one(log, located.at_median, starts, part.setting, each, edges) for each in located.channels], 0
    )
    return found


def exactly(part: Scene, located: LocatedJump) -> int:
    """The sample of a jump that is about there: first in steps, then by the sample."""
    found, within = located.sample, located.width
    while within:
        edges = edges_about(len(part.possible), found, within)
        if len(edges) <= 2:
            break
        gain = gains_of(part, located, edges, scan.steps_of)
        found = int(edges[1 + int(gain[1:].argmax())])
        within //= TRIED // 2
    return found


def other_end(part: Scene, located: LocatedJump, about: int, within: int, more: bool) -> int:
    """The other end of a stretch that begins or ends with a jump, to the sample, about where it is."""
    n = len(part.possible)
    edges = _fine(n, about, within, located.sample)
    gain = gains_of(part, located, edges)[int(more)]
    along = _from(gain, int(np.searchsorted(edges, located.sample)))
    along[(edges == 0) | (edges == n) | (np.abs(edges - located.sample) < SHORTEST)] = 0.0
    return int(edges[int(along.argmax())])


def edges_about(n: int, sample: int, within: int) -> IntArray:
    """Edges at some of the samples within so many of one, and at the ends of n."""
    about = np.linspace(sample - within, sample + within, TRIED).astype(np.int64)
    return np.unique(np.clip([0, *about, n], 0, n))


def _fine(n: int, about: int, within: int, *others: int) -> IntArray:
    """Edges at each sample within so many of one, at some others, and at the ends of n."""
    return np.unique(np.clip([0, *others, *range(about - within, about + within + 1), n], 0, n)).astype(np.int64)
