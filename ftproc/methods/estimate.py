"""What every method takes and gives."""

from __future__ import annotations

from typing import NamedTuple

from ftproc.core.forward import FilterRun, Model
from ftproc.core.smoother import SmootherRun
from ftproc.records import FlagArray, FloatArray


class Readings(NamedTuple):
    """A log as the methods see it: time_s (n,) from zero, measurement (n, 3) with NaN where missing, and which
    components' noise cannot be had from the log, with what is assumed for it: (3,) 1-sigma m, rad, rad, NaN where
    the log tells."""

    time_s: FloatArray
    measurement: FloatArray
    assumed_sigma: FloatArray


class Estimate(NamedTuple):
    """What a method found.

    run: the recursive filter. label: (n, 3) good, isolated, patch, missing. model: noise and jerk used.
    smoothed: the smoother's run when it was asked for. reacquired: samples at which the filter began anew.
    settled: whether two-pass editing's decisions stood still; None where there were none to make. slow_noise: the
    noise is correlated too slowly to be told from motion, so the sigmas are too small. cleaned: (n, 3) readings of a
    method that works on range, azimuth and elevation by themselves; NaN there and in its run means not estimated.
    """

    run: FilterRun
    label: FlagArray
    model: Model
    smoothed: SmootherRun | None = None
    reacquired: tuple[int, ...] = ()
    settled: bool | None = None
    slow_noise: bool = False
    cleaned: FloatArray | None = None
