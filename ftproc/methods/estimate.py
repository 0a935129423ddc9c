"""What every method takes and gives."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from ftproc.core.by_hand import NOTHING, Accepted
from ftproc.core.components import bounded
from ftproc.core.editing.lasting.faults import Faults
from ftproc.core.filtering.records import FilterRun, Model, Observations, Start, Uneven
from ftproc.core.filtering.smoother import SmootherRun
from ftproc.core.identification.coloured_noise import Coloured
from ftproc.core.identification.motions.motion_models import Chosen
from ftproc.long_records import thinned
from ftproc.order_statistics import median
from ftproc.records import FlagArray, FloatArray, Heights, IntArray, forget

if TYPE_CHECKING:
    from ftproc.core.beside import Channel
    from ftproc.core.editing.two_pass import Edited

ASSUMED_READING = (10_000.0, 0.0, 0.0)  # m, rad, rad: stands in for a component that is missing throughout
Run = TypeVar("Run", FilterRun, SmootherRun)
_ONCE = {"innovation", "residual", "nis", "weight"}  # that a reading has, and not a state
SPANS, SPAN = 6, 2_000
MOST_INTERVALS = 250_000  # between neighbours, for a typical one to be found among them


class Readings(NamedTuple):
    """A log as the methods see it: time_s (n,) from zero, measurement (n, 3) with NaN where missing, and which
    components' noise cannot be had from the log, with what is assumed for it: (3,) 1-sigma m, rad, rad, NaN where
    the log tells; the times of the readings of each component that are accepted by hand; and how the noise of single
    readings is known to differ, if it is. range_rate: (n,) m/s, NaN where missing, if there are such, and the interval
    in which they are ambiguous, zero if they are not. heights: beside elevations. edited: the same, if they have been
    edited before. north: which axis points there, where a site is known."""

    time_s: FloatArray
    measurement: FloatArray
    assumed_sigma: FloatArray
    accepted: Accepted = NOTHING
    uneven: Uneven | None = None
    range_rate: FloatArray | None = None
    rate_interval_mps: float = 0.0
    heights: Heights | None = None
    edited: Edited | None = None
    north: int = 1

    def unedited(self) -> Observations:
        """The log with every reading used."""
        return self.weighted(np.isfinite(self.measurement).astype(float))

    def weighted(self, weight: FloatArray) -> Observations:
        """The log with weights (n, 3)."""
        return Observations(self.time_s, self.measurement, weight, self.uneven)


@dataclass(frozen=True)
class Recording:
    """A whole log, of which the methods ask for one stretch at a time; its arrays may lie on a disk.

    time_s: (n,). measurement: (n, 3). assumed_sigma: as in `Readings`. absent: components that are missing throughout.
    rejected: (n, 3) readings that are not to be used, if there are any. accepted, uneven, range_rate,
    rate_interval_mps, heights, edited (all of it), north: as in `Readings`.
    """

    time_s: FloatArray
    measurement: FloatArray
    assumed_sigma: FloatArray
    absent: tuple[int, ...] = ()
    rejected: NDArray[np.bool_] | None = None
    accepted: Accepted = NOTHING
    uneven: Uneven | None = None
    range_rate: FloatArray | None = None
    rate_interval_mps: float = 0.0
    heights: Heights | None = None
    edited: Edited | None = None
    north: int = 1

    def __len__(self) -> int:
        return len(self.time_s)

    def part(self, rows: slice) -> Readings:
        """The readings of a stretch, with times from the log's beginning."""
        measurement = bounded(self.measurement[rows])
        if self.rejected is not None:
            measurement[self.rejected[rows]] = np.nan
        for c in self.absent:
            measurement[:, c] = ASSUMED_READING[c]
        time_s = np.asarray(self.time_s[rows]) - float(self.time_s[0])
        forget(self.time_s, self.measurement)
        uneven = None if self.uneven is None else self.uneven.part(rows)
        rate = None if self.range_rate is None else np.ascontiguousarray(bounded(self.range_rate[rows]))
        measurement = np.ascontiguousarray(measurement)
        heights = self.heights and self.heights._replace(above_m=bounded(self.heights.above_m[rows]))
        beside = uneven, rate, self.rate_interval_mps, heights
        return Readings(time_s, measurement, self.assumed_sigma, self.accepted, *beside, north=self.north)

    def spans(self) -> list[slice]:
        """SPANS stretches of SPAN samples, spread evenly: what noise and usual jerk of a long log are found from."""
        return [slice(first, first + SPAN) for first in np.linspace(0, len(self) - SPAN, SPANS).astype(int)]

    def whole(self) -> Readings:
        """The readings of all of it."""
        return self.part(slice(0, len(self)))._replace(edited=self.edited)


class Estimate(NamedTuple):
    """What a method found.

    run: the recursive filter. label: (n, 3) good, isolated, patch, missing. model: noise and jerk used.
    smoothed: the smoother's run when it was asked for. reacquired: samples at which the filter was re-initialized.
    settled: whether two-pass editing's decisions stood still; None where there were none to make. stamp_s: 1-sigma of
    the time stamps. drifts: whether the noise's variance drifts. alternative: a model with correlated noise
    that explains the log as well, and that the sigmas allow for. cleaned: (n, 3) readings of a method that works on
    range, azimuth and elevation one by one; NaN there and in its run means not estimated. unexamined: runs where
    two-pass editing tried no alternative, its search having been cut short. faults: of the instrument, that
    two-pass editing found and took out of the readings. screened_out: (n, 3) readings that screening rejects, of a
    method without sigmas, whose labels nothing else tests. motion: that was chosen. known: (n,) which samples have an
    estimate, where live editing has none of some; absent: the components that it has not seen. smoothed_sigma_m: the
    median 1-sigma of the position that the smoother would have, where it is known and was not asked for, and
    hindsight: (n, 9) its states. range_rate: what is known of the range rates, see `methods.scalars`; height: of
    the heights beside elevations. last: state and covariance after the last sample, of a ballistic motion. edited: what
    two-pass editing left.
    """

    run: FilterRun
    label: FlagArray
    model: Model
    smoothed: SmootherRun | None = None
    reacquired: tuple[int, ...] = ()
    settled: bool | None = None
    stamp_s: float = 0.0
    drifts: bool = False
    alternative: Coloured | None = None
    cleaned: FloatArray | None = None
    unexamined: int = 0
    faults: Faults | None = None
    screened_out: NDArray[np.bool_] | None = None
    motion: Chosen | None = None
    known: NDArray[np.bool_] | None = None
    absent: tuple[int, ...] = ()
    smoothed_sigma_m: float | None = None
    hindsight: FloatArray | None = None
    range_rate: Channel | None = None
    height: Channel | None = None
    last: Start | None = None
    edited: Edited | None = None

    @property
    def smoothed_run(self) -> FilterRun:
        """The run with the smoother's state and sigmas in place of the filter's, where there is a smoother."""
        s = self.smoothed
        if s is None:
            return self.run
        return self.run._replace(state=s.state, sigma=s.sigma, los_sigma=s.los_sigma, path_sigma=s.path_sigma)

    def rows(self, low: int, high: int) -> Estimate:
        """Of the samples [low, high) alone."""
        if (low, high) == (0, len(self.label)):
            return self
        return self._replace(
            run=self.run.rows(low, high),
            label=self.label[low:high],
            smoothed=None if self.smoothed is None else self.smoothed.rows(low, high),
            reacquired=tuple(k - low for k in self.reacquired if low <= k < high),
            known=None if self.known is None else self.known[low:high],
            cleaned=None if self.cleaned is None else self.cleaned[low:high],
            last=self.last if high == len(self.label) else None,
            hindsight=None if self.hindsight is None else self.hindsight[low:high],
            screened_out=None if self.screened_out is None else self.screened_out[low:high],
            faults=None if self.faults is None else self.faults.rows(low, high),
            motion=None if self.motion is None else self.motion.share((high - low) / len(self.label)),
            range_rate=None if self.range_rate is None else self.range_rate.of_rows(slice(low, high)),
            height=None if self.height is None else self.height.of_rows(slice(low, high)),
        )

    def at(self, sample: IntArray, first: IntArray) -> Estimate:
        """Of rows (n,) that repeat these samples (m,); first (m + 1,): the row of each sample that has its innovation,
        and their number."""
        again = np.ones(len(sample), bool)
        again[first[:-1]] = False

        def repeated(run: Run) -> Run:
            own: dict[str, Any] = {
                name: each[sample] for name, each in run._asdict().items() if isinstance(each, np.ndarray)
            }
            for name in _ONCE & own.keys():
                own[name][again] = 0.0 if name == "weight" else np.nan
            return run._replace(**own)

        return self._replace(
            run=repeated(self.run),
            label=self.label[sample],
            smoothed=None if self.smoothed is None else repeated(self.smoothed),
            reacquired=tuple(int(first[k]) for k in self.reacquired),
            known=None if self.known is None else self.known[sample],
            cleaned=None if self.cleaned is None else self.cleaned[sample],
            hindsight=None,
            screened_out=None if self.screened_out is None else self.screened_out[sample],
            faults=None if self.faults is None else self.faults.at(sample, first),
            range_rate=None if self.range_rate is None else self.range_rate.of_rows(sample),
            height=None if self.height is None else self.height.of_rows(sample),
        )


class Part(NamedTuple):
    """An estimate of some of a log's samples, with more on both sides of those that are meant.

    first: the sample of the log with which the estimate begins. low, high: the samples that are meant are [low, high).
    """

    estimate: Estimate
    first: int
    low: int
    high: int


def typical_interval(time_s: FloatArray) -> float:
    """The median time between neighbours, s; of a very long log (n,) only every so many are used."""
    if len(time_s) < 2:
        return 0.0
    return median(thinned(time_s[1:], MOST_INTERVALS) - thinned(time_s[:-1], MOST_INTERVALS))
