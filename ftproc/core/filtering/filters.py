"""The records that filters work on: state, covariance, and what one measurement update computes on its way."""

from __future__ import annotations

from typing import Annotated, Any, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import record
from ftproc.core.signatures import Layout

FloatArray = NDArray[np.float64]


class Filter(Protocol):
    """The record of a filter: its state, and what one measurement update computes on its way.

    x, p: state and covariance, SI units. noise, late: of this sample, see `records.Sample`. wander, fade_s: variance
    and correlation time of the offset of each component. q: coefficients of Q. z_hat: predicted measurement. e:
    innovation. used: weight of each component, zero for none. h: H on the position. s: innovation covariance. root:
    L^-1, whose rows and columns are zero for components not used. c, y, g, u: see `ukf`. pxz: P H', where it is asked
    for. factor: of the position block of P. d: by pair of sigma points, component and side. bend: its mean, h(x) to
    z_hat.
    """

    x: Annotated[FloatArray, 9]
    p: Annotated[FloatArray, 9, 9]
    noise: Annotated[FloatArray, 3]
    late: Annotated[FloatArray, 3]
    wander: Annotated[FloatArray, 3]
    fade_s: Annotated[FloatArray, 3]
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
    factor: Annotated[FloatArray, 3, 3]
    d: Annotated[FloatArray, 3, 3, 2]
    bend: Annotated[FloatArray, 3]


class Coloured(Filter, Protocol):
    """The record of a filter whose state ends with the offsets of range, azimuth and elevation."""

    x: Annotated[FloatArray, 12]
    p: Annotated[FloatArray, 12, 12]
    u: Annotated[FloatArray, 3, 12]
    pxz: Annotated[FloatArray, 12, 3]


FILTER, COLOURED = record(Filter), record(Coloured)
Filters = Annotated[Any, Layout(FILTER)]
ColouredFilters = Annotated[Any, Layout(COLOURED)]
OFFSETS = 9  # where these begin
