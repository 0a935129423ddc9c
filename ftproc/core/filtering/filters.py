"""The records that filters work on: state, covariance, and what one measurement update computes on its way."""

from __future__ import annotations

from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import part, record
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


class Filter(Protocol):
    """The record of a filter: its state, and what one measurement update computes on its way.

    x, p: state and covariance, SI units. noise, late: of this sample, see `records.Sample`. markov, tau_s: variance
    and correlation time of the offset of each component. jerk: density of the jerk along each axis, see `motion`. q:
    coefficients of Q. z_hat: predicted measurement. e: innovation. used: weight of each component, zero for none. h: H
    on the position. s: innovation covariance. root: L^-1, whose rows and columns are zero for components not used. c,
    y, g, u: see `ukf`. pxz, gain, rest: P H', K and S - H P H', where they are asked for. factor: of the position block
    of P. d: by pair of sigma points, component and side. bend: its mean, h(x) to z_hat. path: see `kinematics`. slope,
    kick, push, along, upward, cross: see `forces`.
    """

    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    noise: Annotated[FloatArray, 3]
    late: Annotated[FloatArray, 3]
    markov: Annotated[FloatArray, 3]
    tau_s: Annotated[FloatArray, 3]
    jerk: Annotated[FloatArray, 3]
    q: Annotated[FloatArray, 3, 3]
    z_hat: Annotated[FloatArray, 3]
    e: Annotated[FloatArray, 3]
    used: Annotated[FloatArray, 3]
    h: Annotated[FloatArray, 3, 3]
    c: Annotated[FloatArray, 3, 3]
    s: Annotated[FloatArray, 3, 3]
    root: Annotated[FloatArray, 3, 3]
    y: Annotated[FloatArray, 3]
    g: Annotated[FloatArray, 3, 3]
    u: Annotated[FloatArray, 3, 9]
    pxz: Annotated[FloatArray, 9, 3]
    gain: Annotated[FloatArray, 9, 3]
    rest: Annotated[FloatArray, 3, 3]
    factor: Annotated[FloatArray, 3, 3]
    d: Annotated[FloatArray, 3, 3, 2]
    bend: Annotated[FloatArray, 3]
    path: Annotated[FloatArray, 6, 6]
    slope: Annotated[FloatArray, 3, 6]
    kick: Annotated[FloatArray, 3, 6]
    push: Annotated[FloatArray, 3]
    along: Annotated[FloatArray, 3]
    upward: Annotated[FloatArray, 3]
    cross: Annotated[FloatArray, 3]


class Coloured(Filter, Protocol):
    """The record of a filter whose state ends with the offsets of range, azimuth and elevation."""

    x: Annotated[FloatArray, 12]
    p: Annotated[FloatArray, 12, 12]
    u: Annotated[FloatArray, 3, 12]
    pxz: Annotated[FloatArray, 12, 3]
    gain: Annotated[FloatArray, 12, 3]


class Update(Protocol):
    """What one measurement update leaves for the way back, under its names in `Filter`."""

    y: Annotated[FloatArray, 3]
    used: Annotated[FloatArray, 3]
    root: Annotated[FloatArray, 3, 3]
    g: Annotated[FloatArray, 3, 3]
    u: Annotated[FloatArray, 3, 9]


class ColouredUpdate(Update, Protocol):
    """The same of a state that ends with the offsets of range, azimuth and elevation."""

    u: Annotated[FloatArray, 3, 12]


class Posterior(Protocol):
    """The state after an update, and the linearisation that led to it, where the way back asks for them; under their
    names in `Filter`."""

    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    e: Annotated[FloatArray, 3]
    h: Annotated[FloatArray, 3, 3]
    c: Annotated[FloatArray, 3, 3]


class ColouredPosterior(Posterior, Protocol):
    """The same of a state that ends with the offsets of range, azimuth and elevation."""

    x: Annotated[FloatArray, 12]
    p: Annotated[FloatArray, 12, 12]


FILTER, COLOURED = record(Filter), record(Coloured)
UPDATE, COLOURED_UPDATE = record(Update), record(ColouredUpdate)
POSTERIOR, COLOURED_POSTERIOR = record(Posterior), record(ColouredPosterior)
Filters = Annotated[Any, Layout(FILTER)]
ColouredFilters = Annotated[Any, Layout(COLOURED)]
Updates = Annotated[Any, Layout(UPDATE)]
ColouredUpdates = Annotated[Any, Layout(COLOURED_UPDATE)]
Posteriors = Annotated[Any, Layout(POSTERIOR)]
ColouredPosteriors = Annotated[Any, Layout(COLOURED_POSTERIOR)]
OFFSETS = 9  # where these begin


@part
def retain(f: Filter, update: Update) -> None:
    """Keep what an update leaves for the way back."""
    for i in range(3):
        update.y[i], update.used[i] = f.y[i], f.used[i]
        for j in range(3):
            update.root[i, j], update.g[i, j] = f.root[i, j], f.g[i, j]
        for j in range(len(f.x)):
            update.u[i, j] = f.u[i, j]


@part
def retain_state(f: Filter, after: Posterior) -> None:
    """Keep the state."""
    for i in range(len(f.x)):
        after.x[i] = f.x[i]
        for j in range(len(f.x)):
            after.p[i, j] = f.p[i, j]


@part
def retain_linearised(f: Filter, after: Posterior) -> None:
    """Keep the innovation, and the linearisation that led to it."""
    for i in range(3):
        after.e[i] = f.e[i]
        for j in range(3):
            after.h[i, j], after.c[i, j] = f.h[i, j], f.c[i, j]
