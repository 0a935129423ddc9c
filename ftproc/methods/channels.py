"""What the methods share that clean range, azimuth and elevation one by one: what they know of the log, and how their
values become a trajectory."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ftproc.core.comparators import channels as kernels
from ftproc.core.comparators.channels import Predictor
from ftproc.core.filtering.records import FilterRun, Model
from ftproc.core.model.frames import from_cartesian, line_of_sight_axes, to_cartesian, wrap
from ftproc.errors import UsageError
from ftproc.methods.estimate import Estimate, Readings
from ftproc.methods.parameters import Parameter, of_component
from ftproc.methods.preparing import labels, trusted
from ftproc.order_statistics import median
from ftproc.records import FloatArray
from ftproc.settings import FilterSettings

MARGIN = 1.5  # on the largest residuals that trusted readings show
SHARE = 0.99  # of them that must be smaller
FEWEST = 8  # residuals that tell how large they are
AZIMUTH = 1
#: Degree -> numbers of values, of the polynomials that are tried.
TRIED = {0: (1,), 1: (3, 4, 6, 10), 2: (4, 6, 8, 12)}
LONGEST_WINDOW = 50
LONGEST = 16  # rejected in a row: the longest run of outliers of Zhang and Zhang
#: Of every method that holds a reading against a polynomial.
POLYNOMIAL = (
    Parameter("order", "degree of the polynomial; 0 is the paper's rule, the value before", "from the log", 0, 2, True),
    Parameter("window", "values that it goes through", "from the log", 1, LONGEST_WINDOW, True),
    Parameter("longest", "readings rejected in a row, after which they are accepted", str(LONGEST), 1, 1000, True),
)


class Log(NamedTuple):
    """time_s (n,) and reading (n, 3), of which the first `led` rows are no readings but the first state, carried back:
    what a method knows when it begins. interval_s: the typical one. sigma: (3,) 1-sigma of the noise, m, rad, rad.
    trusted: (n, 3) readings that screening trusts, and the led rows, NaN for the others."""

    time_s: FloatArray
    reading: FloatArray
    led: int
    interval_s: float
    sigma: FloatArray
    trusted: FloatArray

    def of(self, c: int) -> FloatArray:
        """(n,) readings of component c."""
        return np.ascontiguousarray(self.reading[:, c])


class Cleaned(NamedTuple):
    """What a channel method found, all (n, 3) in m, rad, rad, NaN where it does not say: values; weight, zero where
    rejected; innovations and their sigmas; 1-sigma of the values; their rates per second."""

    value: FloatArray
    weight: FloatArray
    innovation: FloatArray | None = None
    innovation_sigma: FloatArray | None = None
    sigma: FloatArray | None = None
    rate: FloatArray | None = None

    def without(self, led: int) -> Cleaned:
        """Of the rows after the first so many."""
        later = [None if part is None else part[led:] for part in self[2:]]
        return Cleaned(self.value[led:], self.weight[led:], *later)


class Expected(NamedTuple):
    """How well a polynomial foretells the trusted readings of a component. bound: on a reading's residual. walk:
    variance of what the residual gains in an interval."""

    order: int
    window: int
    bound: float
    walk: float


def prepare(readings: Readings, settings: FilterSettings, blindly: bool = False) -> Log:
    """What is known of a log before it is filtered: these papers leave their thresholds to the engineer. blindly: the
    method does not know the first state."""
    time_s, measurement = readings.time_s, readings.measurement
    weight, sigma, start = trusted(readings, settings)
    steps = np.diff(time_s)
    interval = median(steps[steps > 0]) if (steps > 0).any() else 1.0
    accepted = np.where(weight > 0, measurement, np.nan)
    if blindly or start is None:
        return Log(time_s, measurement, 0, interval, sigma, accepted)
    before = time_s[0] - interval * np.arange(LONGEST_WINDOW, 0, -1.0)
    t = (before - time_s[start.sample])[:, None]
    position, velocity, acceleration = start.state.reshape(3, 3)
    carried = from_cartesian(position + velocity * t + 0.5 * acceleration * t**2)
    rows = [np.concatenate([carried, each]) for each in (measurement, accepted)]
    return Log(np.concatenate([before, time_s]), rows[0], LONGEST_WINDOW, interval, sigma, rows[1])


def expect(log: Log, c: int, settings: FilterSettings) -> Expected:
    """The polynomial that foretells component c best, among those that the settings leave open.

    Raises UsageError for a window that is too short for its degree.
    """
    order, window = (settings.parameter(name) for name in ("order", "window"))
    orders = TRIED if order is None else [int(order)]
    tried = [(o, w) for o in orders for w in (TRIED[o] if window is None else [int(window)]) if w > o]
    if not tried:
        raise UsageError(f"--set window={window:g}: a polynomial of degree {order:g} needs more values.")
    found = [_residuals(log, c, o, w, settings.gate) for o, w in tried]
    best = min(range(len(tried)), key=lambda k: (found[k][0], k))
    return Expected(*tried[best], found[best][0], max(found[best][1], 3 * float(log.sigma[c]) ** 2))


def _residuals(log: Log, c: int, order: int, window: int, gate: float) -> tuple[float, float]:
    """The bound on the residuals of good readings that trusted ones suggest, and the variance that they gain in an
    interval, for `gate` sigmas of it to hold the largest. With too few of them, what noise alone does."""
    how = Predictor(order, window, math.inf, 1, log.interval_s, c == AZIMUTH)
    off, gained = kernels.residuals(log.time_s, np.ascontiguousarray(log.trusted[:, c]), how)
    off, gained = (np.abs(each[np.isfinite(each)]) for each in (off, gained))
    sigma = float(log.sigma[c])
    if len(off) < FEWEST:
        return (math.inf if order else gate * math.sqrt(2) * sigma), 0.0
    bound, spread = (MARGIN * float(np.quantile(each, SHARE, method="higher")) for each in (off, gained))
    return max(gate * math.sqrt(2) * sigma, bound), (spread / gate) ** 2


def predictor(log: Log, c: int, expected: Expected, settings: FilterSettings, threshold: str) -> Predictor:
    """What the readings of component c are held against; its threshold may be set by the parameter of that name."""
    bound = of_component(settings, threshold, c, expected.bound)
    longest = int(settings.parameter("longest") or LONGEST)
    return Predictor(expected.order, expected.window, bound, longest, log.interval_s, c == AZIMUTH)


def estimate(readings: Readings, log: Log, found: Cleaned) -> Estimate:
    """Positions from cleaned readings, velocities from their rates; the rest is not estimated. found: of all the log's
    rows."""
    found = found.without(log.led)
    n = len(readings.time_s)
    nothing = np.full((n, 3), np.nan)
    cleaned = found.value.copy()
    cleaned[:, AZIMUTH] = wrap(cleaned[:, AZIMUTH])
    state, sigma, los_sigma = np.full((n, 9), np.nan), np.full((n, 9), np.nan), np.full((n, 6), np.nan)
    state[:, :3] = to_cartesian(cleaned)
    axes = line_of_sight_axes(state[:, :3])
    scale = np.stack([np.ones(n), cleaned[:, 0] * np.cos(cleaned[:, 2]), cleaned[:, 0]], 1)  # m per m, rad, rad
    if found.sigma is not None:
        los_sigma[:, :3] = np.abs(scale) * found.sigma
        sigma[:, :3] = np.sqrt(np.einsum("nia,ni->na", axes**2, los_sigma[:, :3] ** 2))
    if found.rate is not None:
        state[:, 3:6] = np.einsum("nia,ni->na", axes, scale * found.rate)
    run = FilterRun(
        readings.time_s, state, np.full((n, 9), np.nan), sigma,
        nothing if found.innovation is None else found.innovation,
        nothing if found.innovation_sigma is None else found.innovation_sigma,
        found.weight, np.full(n, np.nan), los_sigma, np.full((n, 6), np.nan), np.arange(n), np.nan,
    )  # fmt: skip
    model = Model(log.sigma**2, np.full((1, 3), np.nan))
    label = labels(found.weight, readings.measurement)
    if found.sigma is not None:
        return Estimate(run, label, model, cleaned=cleaned)
    rejected = np.isfinite(readings.measurement) & ~np.isfinite(log.trusted[log.led :])
    return Estimate(run, label, model, cleaned=cleaned, screened_out=rejected)
