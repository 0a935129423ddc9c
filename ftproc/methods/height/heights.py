"""The height of a target instead of its elevation: surveillance radars and those of ships measure none.

With a height h above the station at slant range R, over a round earth of radius R_e (R_e + h and R are two sides of the
triangle with the earth's centre),

    sin E = (h^2 + 2 h R_e - R^2) / (2 R R_e)        z = R sin E        g = R cos E

with g the ground range. **Measured heights** become elevations by this formula, with noise sigma_h / g, and are edited
and filtered as such. **Without**, what is known of the height is a prior, by the user or for all targets of a kind: the
filter works in the plane of range and azimuth, and its estimate is moved to that height: z is the prior, its sigma
that of the prior, and the sigmas of x and y allow for what the prior leaves open of g. What all heights of a log may be
off by together (of barometric ones the pressure and the temperature of the air) is added too.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.core.by_hand import Accepted
from ftproc.core.components import bounded
from ftproc.core.editing.copies import rounding_step
from ftproc.core.filtering.records import Uneven
from ftproc.core.model import kinematics
from ftproc.core.model.earth import MEAN_RADIUS_M as EARTH_M
from ftproc.errors import InputError
from ftproc.methods import anti_outlier, preparing
from ftproc.methods.estimate import Recording
from ftproc.methods.height import alone
from ftproc.methods.height.alone import PRESSURE_M, TEMPERATURE
from ftproc.methods.height.priors import CHANGES_S, Prior, prior_of
from ftproc.order_statistics import median
from ftproc.records import ACCEPTED, ISOLATED, MISSING, PATCH, REJECTED, FlagArray, FloatArray, MeasurementLog
from ftproc.settings import FilterSettings

ABSENT = (2,)  # components that are missing where a height stands in
STEEPEST = 0.9  # sine of the elevation: nearer to the vertical the azimuth says nothing of x and y
MOST_OUTSIDE = 0.1  # share of heights that may be larger than the range


class Common(NamedTuple):
    """What stands for the elevation. prior: if no height is measured. sigma_m: (n,) that all heights may be off by
    together. range_m: by which the noise of the elevations is that of single heights. rejected: (n,) heights that are
    outliers. station_m: the station's own height, m. barometric: whether they are, where they are used as they come.
    silent: (n,) where others stand in. scale: 1-sigma, by a share of which all may be too large or too small."""

    prior: Prior | None
    sigma_m: FloatArray
    range_m: float = 1.0
    rejected: NDArray[np.bool_] | None = None
    station_m: float = 0.0
    barometric: bool | None = None
    silent: NDArray[np.bool_] | None = None
    scale: float = 0.0

    def off_m(self, part: slice, above_m: FloatArray) -> FloatArray:
        """(n,) m 1-sigma of some samples that are so high, (n,) m."""
        return self.sigma_m[part] if self.barometric is None else common_sigma(self.barometric, above_m)

    def figures(self) -> dict[str, Any]:
        """For the summary, JSON-serialisable."""
        if self.prior is None:
            return {"height_common_sigma_m": median(self.sigma_m)}
        return {"height_m": self.prior.height_m, "height_sigma_m": self.prior.sigma_m, "height_of": self.prior.why}


def stand_in(recording: Recording, log: MeasurementLog, settings: FilterSettings) -> tuple[Recording, Common | None]:
    """The recording with elevations by the heights of the log, and what is known of these; None where a height would
    not help, because more is missing than the elevation, or nothing is. Raises InputError for heights that cannot be
    those of the target."""
    if recording.absent != ABSENT:
        return recording, None
    heights, causal, by_hand = log.heights, settings.editing in ("live", "forward"), np.zeros(len(log), np.uint8)
    if log.by_hand is not None:
        by_hand = log.by_hand.of("height")
    if heights is None or not np.isfinite(heights.above_m).any() or settings.height is not None:
        return recording, Common(prior_of(log, settings, causal), np.zeros(len(log)))
    measurement = bounded(log.measurement)
    station_m = settings.site[2] if settings.site is not None else 0.0
    if causal:
        return _as_they_come(recording, log, by_hand, station_m)
    above = np.where(by_hand == REJECTED, np.nan, bounded(heights.above_m) - station_m)
    slant, step = _cleaned_ranges(recording, settings), rounding_step(heights.above_m)
    own, good = alone.screened(log.time_s, above, step)
    good |= by_hand == ACCEPTED
    rejected = np.isfinite(above) & ~good
    most = prior_of(log, settings).sigma_m
    above, away_m, silent = alone.standing_in(log.time_s, np.where(good, above, np.nan), most)
    measurement[:, 2] = elevation(above, slant)
    _check(log, np.isfinite(above) & np.isfinite(slant), measurement[:, 2])
    ground = np.maximum(slant * np.cos(measurement[:, 2]), 1.0)
    each = np.where(silent, math.sqrt(CHANGES_S / alone.SILENT_S) * away_m, own) / ground
    typical = float(np.nanmedian(each[good]))
    common = common_sigma(heights.barometric, above)
    times = np.ones((len(log), 3))
    times[:, 2] = np.where(np.isfinite(each), (each / typical) ** 2, 1.0)
    assumed = recording.assumed_sigma.copy()
    assumed[2] = typical
    times_s = log.time_s - log.time_s[0]
    decided = recording.accepted.times or (np.zeros(0),) * 3
    accepted = Accepted((*decided[:2], times_s[good | silent], *decided[3:]))
    uneven = Uneven(times, np.zeros_like(times))
    found = replace(
        recording, measurement=measurement, assumed_sigma=assumed, absent=(), accepted=accepted, uneven=uneven
    )
    known = np.where(np.isfinite(common), common, float(np.nanmedian(common)))
    off_m, scale = np.hypot(np.hypot(known, away_m), step / math.sqrt(12)), TEMPERATURE * heights.barometric
    return found, Common(None, off_m, own / typical, rejected, station_m, silent=silent, scale=scale)


def at(common: Common | None, absent: tuple[int, ...], log: MeasurementLog, settings: FilterSettings) -> Common | None:
    """What stands for the elevation of rows before which these components were never seen."""
    if absent != ABSENT or (common is not None and common.prior is not None):
        return common
    return Common(prior_of(log, settings, causal=True), np.zeros(len(log)))


def _as_they_come(
    recording: Recording, log: MeasurementLog, by_hand: FlagArray, station_m: float
) -> tuple[Recording, Common]:
    """The recording with elevations by the heights, each with the range of its own row, and what is known of these by
    then; the editor finds their noise and outliers."""
    assert log.heights is not None
    measurement = bounded(log.measurement)
    above = np.where(by_hand == REJECTED, np.nan, bounded(log.heights.above_m) - station_m)
    measurement[:, 2] = elevation(above, measurement[:, 0])
    _check(log, np.isfinite(above) & (measurement[:, 0] > 0), measurement[:, 2])
    ground = measurement[:, 0] * np.cos(measurement[:, 2])
    times, decided = log.time_s - log.time_s[0], recording.accepted.times or (np.zeros(0),) * 3
    accepted = Accepted((*decided[:2], times[by_hand == ACCEPTED], *decided[3:]))
    found = replace(recording, measurement=measurement, absent=(), accepted=accepted)
    barometric, typical = log.heights.barometric, max(float(np.nanmedian(ground)), 1.0)
    off = common_sigma(barometric, np.nan_to_num(above))
    return found, Common(None, off, typical, None, station_m, barometric, scale=TEMPERATURE * barometric)


def common_sigma(barometric: bool, above_m: FloatArray) -> FloatArray:
    """(n,) m 1-sigma that heights (n,) m may be off by together."""
    found: FloatArray = np.hypot(PRESSURE_M, TEMPERATURE * above_m) if barometric else np.zeros(len(above_m))
    return found


def elevation(above_m: FloatArray, range_m: FloatArray) -> FloatArray:
    """(n,) rad, of a target so high above the station; NaN where a height is larger than the range."""
    with np.errstate(invalid="ignore", divide="ignore"):
        ratio = sine(above_m, range_m)
        return np.where(np.abs(ratio) <= 1, np.arcsin(np.clip(ratio, -1, 1)), np.nan)


def _check(log: MeasurementLog, both: NDArray[np.bool_], elevation: FloatArray) -> None:
    outside = both & np.isnan(elevation)
    if outside.sum() > MOST_OUTSIDE * both.sum():
        row = int(log.row[int(np.argmax(outside))])
        raise InputError(
            f"{log.name}: {outside.sum()} of {both.sum()} heights are larger than the range (first: row {row}), so "
            "they are not those of the target in this unit. Say --units height=ft or m or fl, or --columns height=none."
        )


def sine(height_m: FloatArray, range_m: FloatArray) -> FloatArray:
    """Of the elevation, of a target so high above the station over a round earth."""
    found: FloatArray = (height_m**2 + 2 * height_m * EARTH_M - range_m**2) / (2 * range_m * EARTH_M)
    return found


def _cleaned_ranges(recording: Recording, settings: FilterSettings) -> FloatArray:
    """(n,) by the readings of range and azimuth alone, edited and smoothed."""
    plain = replace(settings, method=FilterSettings.method, editing="two-pass", smooth=True, parameters=())
    found = np.empty(len(recording))
    for part in anti_outlier.parts(recording, plain):
        run = part.estimate.smoothed_run
        state = run.state[part.low : part.high, :3]
        found[part.first + part.low : part.first + part.high] = np.sqrt((state**2).sum(1))
    return found


def placed(
    common: Common, part: slice, state: FloatArray, sigma: FloatArray, path_sigma: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """The states (n, 9), their sigmas (n, 9) and those of `kinematics` (n, 6) of some samples, with the prior of the
    height instead of z, and with what the heights may be off by together."""
    if common.prior is None:
        found, wide = state, _widened(state, sigma, common.off_m(part, state[:, 2]), common.scale)
    else:
        found, wide = _moved(common.prior, state, sigma)
    return found, wide, kinematics.widened(found, path_sigma, sigma, np.maximum(wide, sigma))


def elevated(common: Common, part: slice, cleaned: FloatArray, sigma: FloatArray) -> FloatArray:
    """The sigmas (n, 3) of the cleaned readings (n, 3), with what the heights may be off by together."""
    if common.prior is not None:
        return sigma
    ground = np.maximum(cleaned[:, 0] * np.cos(cleaned[:, 2]), 1.0)
    off = common.off_m(part, cleaned[:, 0] * np.sin(cleaned[:, 2]))
    return np.column_stack([sigma[:, :2], np.hypot(sigma[:, 2], off / ground)])


def relabelled(common: Common, part: slice, label: FlagArray) -> FlagArray:
    """The labels (n, 3) of some samples of a log with heights, with those of the heights for the elevations."""
    if common.rejected is None or common.silent is None:
        return label
    rejected, found = common.rejected[part], label.copy()
    found[common.silent[part], 2] = MISSING
    there = np.flatnonzero(rejected | (found[:, 2] != MISSING))
    used = np.ones((len(there), 3))
    used[:, 2] = ~rejected[there] & ~np.isin(found[there, 2], (ISOLATED, PATCH))
    found[there, 2] = preparing.labels(used, np.zeros_like(used))[:, 2]
    return found


def labelled(label: FlagArray) -> tuple[FlagArray, dict[str, FlagArray]]:
    """The labels (n, 3) of a log with heights for elevations, whose elevations are missing, and the column of those of
    the heights."""
    alone = np.where([False, False, True], MISSING, label).astype(np.uint8)
    return alone, {"outlier_height": np.ascontiguousarray(label[:, 2])}


def _moved(prior: Prior, state: FloatArray, sigma: FloatArray) -> tuple[FloatArray, FloatArray]:
    """The states (n, 9) of the plane of range and azimuth moved to a height, and their sigmas (n, 9)."""
    slant = np.maximum(np.sqrt((state[:, :3] ** 2).sum(1)), 1e-9)
    ratio = np.clip(sine(np.full(len(slant), prior.height_m), slant), -STEEPEST, STEEPEST)
    ground, z = slant * np.sqrt(1 - ratio**2), slant * ratio
    flat = np.maximum(np.hypot(state[:, 0], state[:, 1]), 1e-9)
    along, across = state[:, :2] / flat[:, None], np.stack([-state[:, 1], state[:, 0]], 1) / flat[:, None]
    v, turned, a, bent = ((state[:, k : k + 2] * axis).sum(1) for k in (3, 6) for axis in (along, across))
    spin = turned / flat  # of the azimuth, rad/s
    spun = (bent - 2 * v * spin) / flat
    speed = slant / ground * (1 + z / EARTH_M) * v
    growth = (v**2 + slant * (a + flat * spin**2) - speed**2) / ground
    found, wide = np.zeros_like(state), sigma * (slant / ground)[:, None]
    found[:, :2] = along * ground[:, None]
    found[:, 2] = z
    found[:, 3:5] = along * speed[:, None] + across * (ground * spin)[:, None]
    found[:, 6:8] = along * (growth - ground * spin**2)[:, None] + across * (ground * spun + 2 * speed * spin)[:, None]
    wide[:, [2, 5, 8]] = prior.sigma_m / prior.changes_s ** np.arange(3)
    rate_mps = prior.sigma_m / prior.changes_s
    ends = np.sqrt([np.maximum(slant**2 - (z + sign * 2 * prior.sigma_m) ** 2, 0.0) for sign in (-1, 1)])
    open_m = np.abs(ends - ground).max(0) / 2
    _add(wide, 0, along, open_m)
    _add(wide, 3, along, np.hypot(np.abs(speed) * open_m, np.hypot(z, prior.sigma_m) * rate_mps) / ground)
    found[np.isnan(state[:, :3]).any(1)] = wide[np.isnan(state[:, :3]).any(1)] = np.nan
    return found, wide


def _add(sigma: FloatArray, first: int, along: FloatArray, more: FloatArray) -> None:
    """Add an independent error along the ground range to the sigmas of two axes, from a column on."""
    sigma[:, first : first + 2] = np.hypot(sigma[:, first : first + 2], along * more[:, None])


def _widened(state: FloatArray, sigma: FloatArray, off_m: FloatArray, scale: float) -> FloatArray:
    """The sigmas (n, 9) with an error (n,) that all heights have together, of which a share grows with them."""
    flat, wide = np.maximum(np.hypot(state[:, 0], state[:, 1]), 1e-9), sigma.copy()
    along, rate = state[:, :2] / flat[:, None], np.abs(state[:, 5])
    steep = np.minimum(np.abs(state[:, 2]) / flat, 10.0)
    wide[:, 2] = np.hypot(sigma[:, 2], off_m)
    wide[:, [5, 8]] = np.hypot(sigma[:, [5, 8]], scale * state[:, [5, 8]])
    _add(wide, 0, along, steep * off_m)
    _add(wide, 3, along, np.minimum(rate / flat, 1.0) * off_m + steep * scale * rate)
    return wide
