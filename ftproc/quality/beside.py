"""Readings and residuals of what a log measures beside range, azimuth and elevation: range rates and heights."""

from __future__ import annotations

import numpy as np

from ftproc.core import impact
from ftproc.core.beside import Channel
from ftproc.core.model.earth import MEAN_RADIUS_M
from ftproc.methods.height.heights import Common
from ftproc.records import BESIDE, Beside, Diagnostics, FlagArray, FloatArray, MeasurementLog


def of_rates(log: MeasurementLog, channel: Channel, cleaned: FloatArray, sigma: FloatArray) -> Beside:
    """Of the range rates of a log (of n rows): their innovations, also of a smoothed run. cleaned, sigma: (n,) m/s."""
    assert log.range_rate is not None
    return _of_scalars(-log.range_rate if channel.closing else log.range_rate, channel, cleaned, sigma)


def of_heights_beside(log: MeasurementLog, channel: Channel, state: FloatArray, sigma: FloatArray) -> Beside:
    """Of heights beside the elevations of a log (of n rows), see `of_rates`. state, sigma: (n, 9)."""
    assert log.heights is not None
    return _of_scalars(log.heights.above_m, channel, impact.heights(state[:, :3]) + channel.off, sigma[:, 2])


def _of_scalars(reading: FloatArray, channel: Channel, cleaned: FloatArray, sigma: FloatArray) -> Beside:
    if channel.why or len(channel.innovation) != len(reading):  # they are not used: there are no sigmas
        return Beside(reading, cleaned, reading - cleaned, np.full(len(reading), np.nan), channel.label)
    spread = np.sqrt(sigma**2 + channel.rates.variance)
    return _with_unused(reading, cleaned, (channel.innovation, channel.sigma), spread, channel.label)


def of_heights(
    log: MeasurementLog, common: Common, shown: Diagnostics, cleaned: FloatArray, sigma: FloatArray, label: FlagArray
) -> Beside:
    """Of the heights of a log (of n rows), by the residuals of the elevations that stand for them. shown: these;
    cleaned (n, 3) m, rad, rad; sigma (n,) rad of a height, and of its noise, in the elevation; label (n,)."""
    assert log.heights is not None
    slant, ground = cleaned[:, 0], np.maximum(cleaned[:, 0] * np.cos(cleaned[:, 2]), 1.0)
    z = slant * np.sin(cleaned[:, 2])
    above = np.sqrt(MEAN_RADIUS_M**2 + 2 * MEAN_RADIUS_M * z + slant**2) - MEAN_RADIUS_M + common.station_m
    of_elevations = (ground * shown.residual[:, 2], ground * shown.residual_sigma[:, 2])
    return _with_unused(log.heights.above_m, above, of_elevations, ground * sigma, label)


def stacked(shown: Diagnostics) -> tuple[FloatArray, FloatArray]:
    """(n, 5) residuals of all channels and their sigmas, NaN of those that are not there."""
    nothing = np.full(len(shown.residual), np.nan)
    there = [shown.beside.get(name) for name in BESIDE]
    return (
        np.column_stack([shown.residual, *(nothing if each is None else each.residual for each in there)]),
        np.column_stack([shown.residual_sigma, *(nothing if each is None else each.residual_sigma for each in there)]),
    )


def _with_unused(
    reading: FloatArray, cleaned: FloatArray, known: tuple[FloatArray, FloatArray], spread: FloatArray, label: FlagArray
) -> Beside:
    """The residuals that are known with their sigmas, and those of readings that the estimate has never seen."""
    residual, sigma = known
    there = np.isfinite(residual) & np.isfinite(sigma)
    return Beside(reading, cleaned, np.where(there, residual, reading - cleaned), np.where(there, sigma, spread), label)
