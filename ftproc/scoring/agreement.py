"""Whether a truth is that of a trajectory at all: it may have other axes or another clock, or be of another flight."""

from __future__ import annotations

import numpy as np

from ftproc.records import FloatArray, Truth
from ftproc.scoring.matching import match

FAR_BETTER = 0.1  # share of the error that remains, at most, with other axes or another clock
OF_ANOTHER, OF_RANGE = 0.5, 0.1  # of the typical distance of a flight's points from their middle, or of this share of
# that from the station, beyond which a truth is of another
SAMPLES, SHIFTS, STEPS = 300, 2000, 12  # of the trajectory, shifts of the clock, and steps that refine the best
NEAR_S, NEAR_M = 0.05, 1.0  # s, within which a shift has a name; m, of errors that need no doubt
HOUR_S = 3600.0
CLOCKS = {18.0: "GPS against UTC", 19.0: "GPS against TAI", 37.0: "TAI against UTC"}


def doubt(name: str, time_s: FloatArray, position_m: FloatArray, truth: Truth) -> str | None:
    """A sentence where a truth does not belong to a trajectory of this name as it is; None where it may. time_s (n,)
    never decreasing, position_m (n, 3) NaN where unknown."""
    known = np.flatnonzero(np.isfinite(position_m).all(1))
    if not len(known):
        return None
    some = known[np.unique(np.linspace(0, len(known) - 1, SAMPLES).astype(int))]
    t, x = time_s[some], position_m[some]
    error = _median_m(x - match(t, truth).position_m)
    if error < NEAR_M:
        return None
    if _median_m(x - match(t, truth).position_m[:, [1, 0, 2]]) < FAR_BETTER * error:
        return (
            f"{truth.name} fits {name} far better with x and y exchanged: one has x north, the other x east. "
            "Exchange x and y in the truth (vx and vy too)."
        )
    shift_s, left = _best_shift(t, x, truth)
    if left < FAR_BETTER * error and abs(shift_s) > NEAR_S:
        way = "ahead of" if shift_s > 0 else "behind"
        return (
            f"{truth.name} fits {name} far better when its clock is moved: it is {_said(abs(shift_s))} {way} that of "
            f"the trajectory ({left:.3g} m instead of {_metres(error)}). Correct the times of the truth."
        )
    size = max(_median_m(x - np.median(x, 0)), OF_RANGE * _median_m(x))
    if not np.isfinite(error) or left <= OF_ANOTHER * size:
        return None
    return (
        f"{truth.name} is {_metres(min(left, error))} from {name} (median) however its clock is moved: is it the truth "
        "of another flight, or from another origin?"
    )


def _best_shift(t: FloatArray, x: FloatArray, truth: Truth) -> tuple[float, float]:
    """By how many seconds the truth's clock is ahead, and the median distance m with its times less by that; infinite
    where no shift lets both overlap by half."""
    usable = np.isfinite(truth.position_m).all(1)
    own_t, own = truth.time_s[usable], truth.position_m[usable]
    if len(own_t) < 2 or len(t) < 2:
        return 0.0, np.inf
    low, high = own_t[0] - t[-1], own_t[-1] - t[0]
    half = 0.5 * min(t[-1] - t[0], own_t[-1] - own_t[0])
    grid = np.linspace(low + half, max(high - half, low + half), SHIFTS)
    hours = HOUR_S / 2 * np.arange(-48, 49)
    named = np.array([sign * each for each in CLOCKS for sign in (-1, 1)])
    found = min((_apart(t + shift, x, own_t, own), float(shift)) for shift in np.r_[0.0, named, hours, grid])
    width = float(grid[1] - grid[0])
    for _ in range(STEPS):
        found = min(found, *((_apart(t + s, x, own_t, own), s) for s in (found[1] - width, found[1] + width)))
        width /= 2
    return found[1], found[0]


def _apart(t: FloatArray, x: FloatArray, own_t: FloatArray, own: FloatArray) -> float:
    """Median distance of a trajectory from a truth at these times; infinite where they overlap by less than half."""
    inside = (t >= own_t[0]) & (t <= own_t[-1])
    if inside.sum() < len(t) / 2:
        return np.inf
    there = np.stack([np.interp(t[inside], own_t, own[:, axis]) for axis in range(3)], 1)
    return _median_m(x[inside] - there)


def _said(shift_s: float) -> str:
    """A shift with its usual reason, if there is one."""
    for clock_s, why in CLOCKS.items():
        if abs(shift_s - clock_s) < NEAR_S:
            return f"{clock_s:g} s ({why})"
    halves = shift_s / (HOUR_S / 2)
    if round(halves) and abs(halves - round(halves)) * HOUR_S / 2 < 1.0:
        return f"{round(halves) / 2:g} h (a time zone)"
    return f"{shift_s:.4g} s"


def _metres(distance: float) -> str:
    if not np.isfinite(distance):
        return "no common time"
    return f"{distance / 1000:.3g} km" if distance >= 1000 else f"{distance:.3g} m"


def _median_m(error: FloatArray) -> float:
    """Median length of (n, 3) errors; infinite where there is none."""
    length = np.sqrt((error**2).sum(1))
    there = length[np.isfinite(length)]
    return float(np.median(there)) if len(there) else np.inf
