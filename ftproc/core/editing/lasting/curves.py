"""A fault of the readings that lasts: a curve of a few terms that one channel is off by, from one sample to another.

A patch, a step that stays (it ends with the log), a clock that jumps, another target (all components at once): all are
columns of the same linear problem (`filtering.columns`), so that their sizes are integrated out exactly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ftproc.core.filtering.columns import Columns, said_of
from ftproc.core.filtering.records import Model, Observations, Start
from ftproc.core.model.frames import wrap
from ftproc.records import FloatArray, IntArray

CLOCK = 3  # instead of a component
WIDE, WIDE_CLOCK = 25.0, 10.0  # sigmas of the noise, and intervals: half of all terms are smaller, the others of any
# size (Cauchy)
ROUNDS, NEAR = 4, 0.1  # of finding the sizes, because the track bends with them; sigmas that they may yet move


class Curve(NamedTuple):
    """From sample `begin` to `end` the readings of a component (range, azimuth, elevation) of a station are larger by
    the polynomial whose Legendre coefficients over their time are `size`, m, rad, rad, or, where it is CLOCK, their
    times, s. Sizes that are not known yet are zero. wave: of another curve the rate, rad/s, and by how much it dies
    away, 1/s; its sizes are those of its cosine and sine from the first of its readings on."""

    component: int
    begin: int
    end: int
    size: tuple[float, ...]
    station: int = 0
    wave: tuple[float, float] | None = None

    @property
    def rows(self) -> slice:
        return slice(self.begin, self.end)

    @property
    def length(self) -> int:
        """Samples that it acts on."""
        return self.end - self.begin

    def of(self, terms: int) -> Curve:
        """With so many terms, of no size."""
        return self._replace(size=(0.0,) * terms)

    def within(self, span: slice) -> Curve:
        """As seen in a part of the log."""
        return self._replace(begin=max(self.begin, span.start) - span.start, end=min(self.end, span.stop) - span.start)


class Setting(NamedTuple):
    """What a curve needs to know of its log: time_s (n,), late (n, 3) by which each reading grows with an offset of its
    clock, per s, and station (n,) of each sample, None where there is one."""

    time_s: FloatArray
    late: FloatArray
    station: IntArray | None = None

    def part(self, rows: slice | IntArray) -> Setting:
        """Of some of the samples."""
        return Setting(self.time_s[rows], self.late[rows], None if self.station is None else self.station[rows])

    def rows(self, curve: Curve) -> IntArray:
        """The samples that a curve acts on."""
        rows = np.arange(curve.begin, curve.end)
        return rows if self.station is None else rows[self.station[rows] == curve.station]

    def interval_s(self) -> float:
        """A typical one."""
        steps = np.diff(self.time_s)
        return float(np.median(steps[steps > 0])) if (steps > 0).any() else 1.0


class Fitted(NamedTuple):
    """Curves with the sizes that a log tells, in the order of their begins, the log without them, the log-probability
    of its readings with the sizes integrated out, and the covariance of the sizes, curve by curve."""

    curves: tuple[Curve, ...]
    log: Observations
    log_probability: float
    covariance: FloatArray


def _basis(curve: Curve, time_s: FloatArray) -> FloatArray:
    """(m, terms) of a curve at the times (m,) of its readings."""
    if not len(time_s):
        return np.zeros((0, len(curve.size)))
    if curve.wave is not None:
        return swing(*curve.wave, time_s - time_s[0])
    half = max(0.5 * (time_s[-1] - time_s[0]), 1e-300)
    found: FloatArray = np.polynomial.legendre.legvander((time_s - time_s[0]) / half - 1.0, len(curve.size) - 1)
    return found


def swing(rate_radps: float, decay_per_s: float, time_s: FloatArray) -> FloatArray:
    """(m, 2) cosine and sine that die away from the time zero on."""
    cycles = np.stack([np.cos(rate_radps * time_s), np.sin(rate_radps * time_s)], 1)
    found: FloatArray = np.exp(-decay_per_s * time_s)[:, None] * cycles
    return found


def columns_of(curves: Sequence[Curve], setting: Setting) -> Columns:
    """The terms of curves, as a filter carries them; the curves in the order of their begins."""
    m = sum(len(curve.size) for curve in curves)
    design, when, k = np.zeros((len(setting.time_s), 3, m)), list[tuple[int, int]](), 0
    for curve in curves:
        rows, own = setting.rows(curve), slice(k, k + len(curve.size))
        basis = _basis(curve, setting.time_s[rows])
        if curve.component == CLOCK:
            design[rows, :, own] = setting.late[rows, :, None] * basis[:, None, :]
        else:
            design[rows, curve.component, own] = basis
        when += len(curve.size) * [(curve.begin, curve.end)]
        k = own.stop
    begin, end = np.array(when, np.int64).reshape(-1, 2).T.copy()
    return Columns(design, begin, end, np.full(m, -1))


def without(measurement: FloatArray, setting: Setting, curves: Sequence[Curve]) -> FloatArray:
    """Readings (n, 3) with the curves taken out."""
    z = measurement.copy()
    for curve in curves:
        rows = setting.rows(curve)
        size = _basis(curve, setting.time_s[rows]) @ np.array(curve.size)
        if curve.component == CLOCK:  # by the rates halfway
            half = setting.time_s[rows] - 0.5 * size
            for c in range(3):
                z[rows, c] -= size * np.interp(half, setting.time_s[rows], setting.late[rows, c])
        else:
            z[rows, curve.component] -= size
    z[:, 1] = wrap(z[:, 1])
    return z


def fitted(log: Observations, model: Model, starts: list[Start], setting: Setting, curves: Sequence[Curve]) -> Fitted:
    """The curves with the likeliest sizes, from those that they have on."""
    curves = sorted(curves, key=lambda curve: curve.begin)
    columns, scale = columns_of(curves, setting), np.concatenate([_scales(curve, model, setting) for curve in curves])
    size = np.concatenate([curve.size for curve in curves])
    for _ in range(ROUNDS):
        rest = log._replace(measurement=without(log.measurement, setting, curves))
        said = said_of(rest, model, starts, columns)
        stiff = said.information + np.diag(2 / (scale**2 + size**2))
        step = np.linalg.solve(stiff, said.score - 2 * size / (scale**2 + size**2))
        size = size + step
        curves = _sized(curves, size)
        if (np.abs(step) < NEAR / np.sqrt(np.diag(stiff))).all():
            break
    gained = said.score @ step - 0.5 * step @ said.information @ step
    prior = -np.log(math.pi * scale) - np.log1p((size / scale) ** 2)
    integral = 0.5 * (len(size) * math.log(2 * math.pi) - np.linalg.slogdet(stiff)[1])
    likely = float(said.log_likelihood + gained + prior.sum() + integral)
    rest = log._replace(measurement=without(log.measurement, setting, curves))
    return Fitted(tuple(curves), rest, likely, np.asarray(np.linalg.inv(stiff), float))


def _scales(curve: Curve, model: Model, setting: Setting) -> FloatArray:
    """(terms,) of the sizes of its terms."""
    if curve.component == CLOCK:
        return np.full(len(curve.size), WIDE_CLOCK * setting.interval_s())
    sigma = np.sqrt(model.noise_variance.reshape(-1, 3)[curve.station, curve.component])
    return np.full(len(curve.size), WIDE * sigma)


def _sized(curves: Sequence[Curve], size: FloatArray) -> list[Curve]:
    bounds = np.cumsum([len(curve.size) for curve in curves])[:-1]
    pieces = np.split(size, bounds)
    return [curve._replace(size=tuple(own.tolist())) for curve, own in zip(curves, pieces, strict=True)]
