"""What a filter is given and what it leaves behind: NamedTuples of arrays, and the records that kernels work on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from ftproc.core.compiled import empty, kernel, record, zeros
from ftproc.core.filtering import beside as layout
from ftproc.core.filtering.filters import COLOURED, FILTER
from ftproc.core.model.motion import NO_JOLTS, WHITE_JERK, Jolts, Motion, Profile
from ftproc.core.signatures import Layout, Matrix, Vector

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]

ELSEWHERE, ABOUT = 1.0, 2.0  # see `Sample.placed`


class Sample(Protocol):
    """One row of a log: measurement m, rad, rad, NaN where missing; the weight of each component in [0, 1], zero for
    one that is not used; the variance of its noise at full weight, and the 1-sigma that a late time stamp adds to all
    three at once. placed: ELSEWHERE if the station is not at the origin of the frame, or not level with it: it stands
    at place, m, and the rows of axes are its own x, y and z. ABOUT: the station is at the origin, and its readings are
    linearised about place, not about the state."""

    time_s: float
    measurement: Annotated[FloatArray, 3]
    weight: Annotated[FloatArray, 3]
    noise: Annotated[FloatArray, 3]
    late: Annotated[FloatArray, 3]
    placed: float
    place: Annotated[FloatArray, 3]
    axes: Annotated[FloatArray, 3, 3]


class Row(Protocol):
    """What a recursive filter leaves behind of one sample, see `FilterRun`."""

    predicted: Annotated[FloatArray, 9]
    state: Annotated[FloatArray, 9]
    sigma: Annotated[FloatArray, 9]
    innovation: Annotated[FloatArray, 3]
    innovation_sigma: Annotated[FloatArray, 3]
    weight: Annotated[FloatArray, 3]
    los_sigma: Annotated[FloatArray, 6]
    path_sigma: Annotated[FloatArray, 6]
    nis: float
    since_start: float


SAMPLE, ROW = record(Sample), record(Row)
Samples = Annotated[Any, Layout(SAMPLE)]
Rows = Annotated[Any, Layout(ROW)]


class Uneven(NamedTuple):
    """How the noise of single readings differs from that of their component. times: (n, 3) how many times its variance.
    late: (n, 3) m, rad, rad that a time stamp late by its 1-sigma adds to the three readings of a sample, by the rates
    at which they change."""

    times: FloatArray
    late: FloatArray

    @classmethod
    def none(cls, samples: int) -> Uneven:
        """That of readings which do not differ."""
        return cls(np.ones((samples, 3)), np.zeros((samples, 3)))

    def part(self, rows: slice | IntArray) -> Uneven:
        """Of some of the samples."""
        return Uneven(self.times[rows], self.late[rows])


class Sites(NamedTuple):
    """Where the samples of several stations were taken: station (n,) of each; place (m, 3) and axes
    (m, 3, 3) of the stations in the frame of the state, see `Sample`; range_m (m,) typical, of the target from each."""

    station: IntArray
    place: FloatArray
    axes: FloatArray
    range_m: FloatArray

    def part(self, rows: slice | IntArray) -> Sites:
        """Of some of the samples."""
        return self._replace(station=self.station[rows])


class Scalars(NamedTuple):
    """One scalar of each sample beside its readings, see `beside`, such as range rates: value (n,) m/s or m, NaN where
    missing, the variance (n,) of their noise and their weight (n,), zero for one that is not used; the kind, and the
    point, (3,) or of each sample (n, 3)."""

    value: FloatArray
    variance: FloatArray
    weight: FloatArray
    kind: float = layout.RATE
    point: FloatArray = np.zeros(3)

    @classmethod
    def rates(cls, value: FloatArray, variance: float, weight: FloatArray) -> Scalars:
        """Range rates of a station at the origin, all of the same noise."""
        return cls(value, np.full(len(value), variance), weight)

    def part(self, rows: slice | IntArray) -> Scalars:
        """Of some of the samples."""
        point = self.point if self.point.ndim == 1 else self.point[rows]
        return self._replace(
            value=self.value[rows], variance=self.variance[rows], weight=self.weight[rows], point=point
        )

    def spread(self, row: IntArray, samples: int) -> Scalars:
        """Of so many samples, among which the own ones are at rows (n,)."""
        value, variance, weight = np.full(samples, np.nan), np.ones(samples), np.zeros(samples)
        value[row], variance[row], weight[row] = self.value, self.variance, self.weight
        point = self.point
        if point.ndim > 1:
            point = np.zeros((samples, 3))
            point[row] = self.point
        return self._replace(value=value, variance=variance, weight=weight, point=point)

    def rows(self) -> FloatArray:
        """What the sweeps work on, see `beside`; without the derivatives."""
        found = np.full((len(self.value), layout.WIDTH), np.nan)
        found[:, layout.VALUE], found[:, layout.VARIANCE] = self.value, self.variance
        found[:, layout.WEIGHT], found[:, layout.KIND] = self.weight, self.kind
        found[:, layout.POINT : layout.POINT + 3] = self.point
        return found


class Observations(NamedTuple):
    """A log as the filters see it: time_s (n,), measurement (n, 3) slant range m, azimuth and elevation rad, NaN where
    missing, the weight (n, 3) in [0, 1] of each reading, zero for one that is not used, how the noise of single
    readings differs, if it does, who took them, if not the one station at the origin, and what is measured beside.
    about: (n, 3) m, places about which the readings of that one station are linearised; NaN: about the state."""

    time_s: FloatArray
    measurement: FloatArray
    weight: FloatArray
    uneven: Uneven | None = None
    sites: Sites | None = None
    beside: tuple[Scalars, ...] = ()
    about: FloatArray | None = None

    def part(self, rows: slice | IntArray) -> Observations:
        """Some of the samples."""
        uneven = None if self.uneven is None else self.uneven.part(rows)
        sites = None if self.sites is None else self.sites.part(rows)
        beside = tuple(each.part(rows) for each in self.beside)
        about = None if self.about is None else self.about[rows]
        return Observations(self.time_s[rows], self.measurement[rows], self.weight[rows], uneven, sites, beside, about)

    def samples(self, noise_variance: FloatArray, made: Any = None) -> Any:
        """The same as an array (n,) of `Sample` records, with noise (3,) m^2, rad^2, rad^2, or (m, 3) by station. made:
        memory for them, if there is some."""
        samples = empty(SAMPLE, len(self.time_s)) if made is None else made
        variance = noise_variance if self.sites is None else np.zeros(3)
        time, z, weight, variance = (np.ascontiguousarray(each, float) for each in (*self[:3], variance))
        _fill(time, z, weight, variance, samples)
        if self.sites is not None:
            station, place, axes, _ = self.sites
            samples["placed"], samples["place"], samples["axes"] = ELSEWHERE, place[station], axes[station]
            samples["noise"] = noise_variance = noise_variance[station]
        if self.uneven is not None:
            samples["noise"], samples["late"] = noise_variance * self.uneven.times, self.uneven.late
        if self.about is not None:
            known = np.isfinite(self.about).all(1)
            samples["placed"][known], samples["place"][known] = ABOUT, self.about[known]
        return samples


@kernel
def _fill(time: Vector, measurement: Matrix, weight: Matrix, variance: Vector, samples: Samples) -> None:
    """Fill the samples (n,) of a station at the origin, whose place and axes nobody asks for."""
    for k in range(len(time)):
        sample = samples[k]
        sample.time_s, sample.placed = time[k], 0.0
        for c in range(3):
            sample.measurement[c], sample.weight[c] = measurement[k, c], weight[k, c]
            sample.noise[c], sample.late[c] = variance[c], 0.0


class Start(NamedTuple):
    """The state (9,) and covariance (9, 9) with which a recursion starts, before the update of `sample`."""

    sample: int
    state: FloatArray
    covariance: FloatArray


def between(starts: list[Start], samples: int) -> Iterator[tuple[Start, int]]:
    """Each start with the sample at which the next one follows, or the log of so many samples ends. Of several at one
    sample the last one counts."""
    stops = [start.sample for start in starts[1:]] + [samples]
    yield from ((start, stop) for start, stop in zip(starts, stops, strict=True) if start.sample < stop)


class Model(NamedTuple):
    """The noise of the measurements, and of the motion.

    noise_variance: (3,) of white noise, m^2, rad^2, rad^2, or (stations, 3). jerk: (m, 3) density of the jerk along x,
    y and z, m^2/s^5, each row holding for `knot_s` seconds from the first sample on. markov_variance, tau_s: (3,) of
    the noise that is correlated in time (first-order Gauss-Markov), which adds to the white; zero for none. motion:
    what moves the target beside its jerk, whose densities are then along the path, across it, and upward; and jolts.
    """

    noise_variance: FloatArray
    jerk: FloatArray
    knot_s: float = math.inf
    markov_variance: FloatArray = np.zeros(3)
    tau_s: FloatArray = np.ones(3)
    motion: Motion = WHITE_JERK
    jolts: Jolts = NO_JOLTS

    @property
    def coloured(self) -> bool:
        """Whether some of the noise is correlated in time."""
        return any(self.markov_variance.tolist())

    def of(self, span: slice) -> Model:
        """The model of a stretch of the log."""
        return self._replace(motion=self.motion.about(self.motion.course[span]))

    @property
    def causal(self) -> Model:
        """The same with a motion that is linearised about the estimate of each time."""
        return self._replace(motion=self.motion.causal)

    @property
    def reading_variance(self) -> FloatArray:
        """(3,) variance of the noise of a single reading."""
        return np.asarray(self.noise_variance + self.markov_variance)

    def correlation(self, interval_s: float) -> FloatArray:
        """(3,) of the noise of readings that are so far apart."""
        found: FloatArray = self.markov_variance / self.reading_variance * np.exp(-interval_s / self.tau_s)
        return found

    def profile(self, time_s: FloatArray) -> Profile:
        """The process noise of a log with these times."""
        return self.jolts.into(Profile(self.jerk, self.knot_s, float(time_s[0]), self.motion), time_s)

    def profile_of(self, log: Observations) -> Profile:
        """The same with what the log has beside its readings."""
        found = self.profile(log.time_s)
        return found._replace(beside=np.stack([each.rows() for each in log.beside])) if log.beside else found

    def filter(self, start: Start) -> Any:
        """An array of one `filters.Filter` record at a start; of one `filters.Coloured` if some noise is correlated."""
        filters = zeros(COLOURED if self.coloured else FILTER)
        filters["x"][0, :9], filters["p"][0, :9, :9] = start.state, start.covariance
        filters["markov"][0], filters["tau_s"][0] = self.markov_variance, self.tau_s
        if self.coloured:
            filters["p"][0, 9:, 9:] = np.diag(self.markov_variance)
        return filters


class FilterRun(NamedTuple):
    """What a recursive filter leaves behind, row for row with the log.

    state, predicted: (n, 9) after and before the update, SI units. sigma: (n, 9) 1-sigma after the update.
    innovation: (n, 3) m, rad, rad, NaN where missing. innovation_sigma: (n, 3) square root of the diagonal of S.
    weight: (n, 3) in [0, 1], zero where rejected or missing. nis: (n,) of the components used, NaN where none.
    los_sigma: (n, 6) 1-sigma of position and velocity along the radial, cross and up axes. path_sigma: (n, 6) of
    ground speed, track, climb rate, flight path angle, turn rate and load factor, see `kinematics`; SI units and rad.
    since_start: (n,) samples since the last start. log_likelihood: of the innovations used.
    """

    time_s: FloatArray
    state: FloatArray
    predicted: FloatArray
    sigma: FloatArray
    innovation: FloatArray
    innovation_sigma: FloatArray
    weight: FloatArray
    nis: FloatArray
    los_sigma: FloatArray
    path_sigma: FloatArray
    since_start: IntArray
    log_likelihood: float

    @classmethod
    def of(cls, time_s: FloatArray, rows: Any, log_likelihood: float) -> FilterRun:
        """From the `Row` records (n,) that a kernel has filled, whose memory it keeps."""
        fields = {name: rows[name] for name in ROW.names or ()}
        fields["since_start"] = fields["since_start"].astype(np.int64)
        return cls(time_s, log_likelihood=log_likelihood, **fields)

    def rows(self, low: int, high: int) -> FilterRun:
        """Of the samples [low, high) alone; the likelihood stays that of the whole run."""
        return FilterRun._make([*(each[low:high] for each in self[:-1]), self.log_likelihood])


def empty_rows(n: int) -> Any:
    """`Row` records (n,) for a kernel to fill."""
    return zeros(ROW, n)
