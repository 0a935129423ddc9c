"""A jump alone: what it is on the log around it, before it is taken for an end of something long.

Two short patches that were missed look, from afar, like one long curve from an edge of one to an edge of the other,
which explains both jumps at the price of one fault, and leaves out all that is good between them. Around each of the
jumps the long curve is but a step, and explains less than the short patch does, whose other edge jumps as well.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator

import numpy as np

from ftproc.core.editing.lasting.curves import CLOCK, Curve
from ftproc.core.editing.lasting.proposals import Channels, LocatedJump, proposals
from ftproc.core.editing.lasting.scanned import End, Scanned, in_whole, weighed_on
from ftproc.core.editing.lasting.weighing import TAKEN_IN, Found, Scene, Weighed
from ftproc.core.identification.profile import median_level
from ftproc.core.identification.stretches import runs_of
from ftproc.records import FloatArray

TERMS = (1, 2, 3)  # of what a part of the log sees of a long curve


def around(seen: Scanned, sample: int) -> slice:
    """The part of the log on which a jump is weighed alone."""
    return seen.near(max(sample - seen.around, 0), min(sample + seen.around, seen.samples))


def by_itself(seen: Scanned, channels: Channels, sample: int) -> End:
    """What a jump of some channels, or of one of them, is alone: found out once."""
    key = tuple(channels), sample
    if key not in seen.ends:
        seen.ends[key] = End(None, -math.inf)
        with contextlib.suppress(ValueError, np.linalg.LinAlgError):  # the part does not tell
            seen.ends[key] = _by_itself(seen, channels, sample)
    return seen.ends[key]


def _by_itself(seen: Scanned, channels: Channels, sample: int) -> End:
    n, near = seen.samples, around(seen, sample)
    part, null = seen.scene.part(near), weighed_on(seen.scene.part(near), near, ())
    sides = (sample, n), (0, sample)  # by one term they are the same
    long = [[Curve(c, a, b, (0.0,) * terms, s) for c, s in channels] for terms in TERMS for a, b in sides[:terms]]
    step = max((weighed_on(part, near, curves) for curves in long), key=_likelihood)
    found = list[Found]()
    for curves in _short(seen, channels, near, sample, step):
        with contextlib.suppress(ValueError, np.linalg.LinAlgError):
            each = weighed_on(part, near, curves)
            gain = each.log_probability - null.log_probability + seen.prior(curves)
            found.append(Found(in_whole(each, near, n), each.sigma, gain))
    short = max((each for each in found if each.gain > 0), key=lambda each: each.gain, default=None)
    if short is None and not _is_rejected(part, channels, sample - near.start, seen.width, null.weight):
        return End(None, -math.inf)
    gain = 0.0 if short is None else short.gain
    return End(short, gain - (step.log_probability - null.log_probability))


def instead_of(seen: Scanned, found: Found) -> list[Found] | None:
    """The short patches that explain the ends of a long fault better, each alone; None if none do, or if it is not
    long. A patch may as well lie beyond an end as within it, and where it begins may be uncertain: that bounds what an
    end tells of what lies within it."""
    n, curves = seen.samples, found.curves
    edges = [edge for edge in (curves[0].begin, curves[0].end) if 0 < edge < n]
    parts = [around(seen, edge) for edge in edges]
    if curves[0].component == CLOCK or (len(edges) > 1 and (parts[0].stop > edges[1] or parts[1].start < edges[0])):
        return None
    one_end = seen.prior(curves) / len(edges)
    beyond = seen.prior([Curve(curves[0].component, 1, n - 1, ())]) - one_end
    channels = [(curve.component, curve.station) for curve in curves]
    ends = [by_itself(seen, channels, edge) for edge in edges]
    if sum(max(end.odds(one_end), beyond) for end in ends) <= 0:
        return None
    return [end.short for end in ends if end.short is not None and end.odds(one_end) > beyond] or None


def _short(seen: Scanned, channels: Channels, near: slice, sample: int, step: Weighed) -> Iterator[list[Curve]]:
    """The short patches, of all channels or of one, that may begin or end with a jump, as a part of the log is
    understood with a step there."""
    part = seen.scene.part(near)
    log, taken_in = part.log._replace(weight=step.weight), np.maximum(step.weight, part.taken_in)
    marks = [jump.sample - near.start for jump in seen.jumps if near.start < jump.sample < near.stop]
    for way in [channels, *([each] for each in channels if len(channels) > 1)]:
        located = LocatedJump(way, sample - near.start, marks, seen.cell, median_level(step.model))
        for curves in proposals(part._replace(log=log, taken_in=taken_in), located):
            if curves[0].begin > 0 and curves[0].end < len(part.possible):
                yield [c._replace(begin=c.begin + near.start, end=c.end + near.start) for c in curves]


def _is_rejected(part: Scene, channels: Channels, sample: int, within: int, weight: FloatArray) -> bool:
    """Whether readings in a row are rejected beside a jump by weights (n, 3)."""
    for c, station in channels:
        rows = part.setting.rows(Curve(c, 0, len(part.possible), (), station))
        rows = rows[part.possible[rows, c]]
        for begin, end in runs_of(weight[rows, c] <= 0, TAKEN_IN):
            if rows[begin] - within <= sample <= rows[end - 1] + within:
                return True
    return False


def _likelihood(of: Weighed) -> float:
    return of.log_probability
