"""What is refused before filtering, and why: logs that cannot be a flight as a whole, settings that make no sense.
Single outliers are left to the editing."""

from __future__ import annotations

import numpy as np

from ftproc.core.by_hand import NOTHING, Accepted
from ftproc.core.components import totals
from ftproc.errors import InputError, UsageError, row_named
from ftproc.long_records import chunks, thinned
from ftproc.methods.estimate import Recording
from ftproc.order_statistics import median
from ftproc.records import ACCEPTED, COMPONENTS, REJECTED, FloatArray, IntArray, MeasurementLog, forget
from ftproc.settings import EDITING, LEAST_NOISE, MOTIONS, FilterSettings

FARTHEST_M = 1e12  # with half of all ranges beyond, the column or its unit is wrong
SHORTEST_S = 1e-6  # the shortest duration of a log of several times; less is a wrong unit
MOST_RANGES = 250_000  # that are checked; a longer log is thinned
LATEST_S = 1e11  # 3000 years; beyond, the unit is not seconds, and differences lose their fractions
LONGEST_LAG_S = 3600.0
SMALLEST = 1e-30  # of noise, jerk PSD and gate: the square and its inverse must be finite
FEWEST_PARTICLES = 20
FEWEST_READINGS = 8  # of a component, to estimate its noise
ASSUMED_SIGMA = (10.0, 1e-3, 1e-3)  # m, rad, rad: of a component with fewer


def recording(log: MeasurementLog) -> Recording:
    """The log as the methods take it. Raises InputError as `check`."""
    count, rejected, accepted, rate, heights = check(log), None, NOTHING, log.range_rate, log.heights
    if log.by_hand is not None:
        flags, of_rates, times = log.by_hand.flags, log.by_hand.of("range_rate"), log.time_s - log.time_s[0]
        of_heights = log.by_hand.of("height")
        accepted = Accepted(tuple(times[flag == ACCEPTED] for flag in (*flags.T, of_rates, of_heights)))
        rejected = flags == REJECTED
        count = count - totals(rejected)
        rate = rate if rate is None else np.where(of_rates == REJECTED, np.nan, rate)
        if heights is not None:
            heights = heights._replace(above_m=np.where(of_heights == REJECTED, np.nan, heights.above_m))
    assumed = np.where(count < FEWEST_READINGS, ASSUMED_SIGMA, np.nan)
    absent = tuple(np.flatnonzero(count == 0).tolist())
    if len(absent) == len(COMPONENTS):
        raise InputError(f"{log.name}: every reading is rejected by hand; check the decisions.")
    return Recording(
        log.time_s, log.measurement, assumed, absent, rejected, accepted, range_rate=rate,
        rate_interval_mps=log.station.range_rate_interval_mps, heights=None if absent else heights,
        north=0 if log.frame == "north-east-up" else 1,
    )  # fmt: skip


def check_settings(settings: FilterSettings) -> None:
    """Raises UsageError for settings out of range."""
    if settings.editing not in EDITING:
        raise UsageError(f"editing is one of {', '.join(EDITING)}, not {settings.editing!r}")
    if settings.motion not in MOTIONS:
        raise UsageError(f"motion is one of {', '.join(MOTIONS)}, not {settings.motion!r}")
    if settings.particles < FEWEST_PARTICLES:
        raise UsageError(f"particles must be {FEWEST_PARTICLES} or more, not {settings.particles}")
    if not 0 <= settings.lag_s <= LONGEST_LAG_S:
        raise UsageError(f"lag must be from 0 to {LONGEST_LAG_S:g} seconds, not {settings.lag_s:g}")
    if settings.editing == "live" and settings.smooth:
        raise UsageError(
            "--smooth takes the whole record, and --editing live what is known by its lag; give a longer --lag instead"
        )
    numbers: list[tuple[str, float | None]] = [("noise", v) for v in settings.noise or ()]
    numbers += [("jerk", settings.jerk_psd_m2ps5), ("gate", settings.gate), ("max-patch", settings.max_patch_s)]
    for name, value in numbers:
        if value is not None and not SMALLEST <= value <= 1 / SMALLEST:
            raise UsageError(f"{name} must be a positive number, from {SMALLEST:g} to {1 / SMALLEST:g}, not {value}")
    for component, sigma, least in zip(COMPONENTS, settings.noise or (None,) * 3, LEAST_NOISE, strict=True):
        if sigma is not None and sigma < least:
            raise UsageError(
                f"noise of the {component} must be at least {least:g}, not {sigma:g}: no instrument is so good, and "
                "readings are rounded more coarsely; give the standard deviation, not the variance"
            )


def no_start(log: MeasurementLog, cause: ValueError) -> InputError:
    """The error for a log in which a method found no initial state."""
    component = cause.args[0] if cause.args and isinstance(cause.args[0], int) else None
    if component is None:
        return InputError(f"{log.name}: {cause}")
    return InputError(
        f"{log.name}: no {COMPONENTS[component]} reading agrees with its neighbours, so there is no first state; "
        "check the column and its unit, or leave it out"
    )


def check(log: MeasurementLog) -> IntArray:
    """(3,) number of readings of each component. Raises InputError when there are none, or when times or ranges are
    impossible."""
    if len(log) == 0:
        raise InputError(f"{log.name}: no row has a time, so there is nothing to filter; check the time column.")
    count = np.zeros(3, np.int64)
    for rows in chunks(len(log)):
        count += totals(np.isfinite(log.measurement[rows]))
        forget(log.measurement)
    if not count.any():
        raise InputError(
            f"{log.name}: range, azimuth and elevation are missing in every row; check the columns and their names."
        )
    _check_times(log)
    _check_ranges(log.name, thinned(log.measurement[:, 0], MOST_RANGES))
    return count


def _check_times(log: MeasurementLog) -> None:
    for k in (0, -1):  # they are in order
        if not abs(log.time_s[k]) <= LATEST_S:
            raise InputError(
                f"{log.name}: {row_named(int(log.row[k]))}: the time {log.time_s[k]:g} s is not that of a flight; "
                "correct it, or name its unit (--units time=ms or time=us)."
            )
    lasts = float(log.time_s[-1] - log.time_s[0])
    if 0 < lasts < SHORTEST_S:
        raise InputError(f"{log.name}: the whole log lasts {lasts:.3g} s; check the time column and its unit.")


def _check_ranges(name: str, ranges: FloatArray) -> None:
    known = ranges[np.isfinite(ranges)]
    within = np.clip(known, -2 * FARTHEST_M, 2 * FARTHEST_M)  # the mean of two huge ones would overflow
    typical = median(within) if known.size else 1.0
    if 0 < typical <= FARTHEST_M:
        return
    what = "zero" if typical == 0 else "negative" if typical < 0 else f"beyond {FARTHEST_M:g} m"
    raise InputError(
        f"{name}: half of the ranges are {what}, which is not a slant range; check the column and its unit, or leave "
        "it out with --columns range=none."
    )
