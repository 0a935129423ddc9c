"""The immutable records that pass from stage to stage: log -> (core) -> trajectory, and the truth.

Components are always in the order range, azimuth, elevation; axes in the order x, y, z; angles in radians.
"""

from __future__ import annotations

import importlib
import mmap
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.settings import Station

if TYPE_CHECKING:
    import pandas as pd
    import pyarrow as pa

FloatArray = NDArray[np.float64]
IntArray = NDArray[np.int64]
FlagArray = NDArray[np.uint8]

COMPONENTS = ("range", "azimuth", "elevation")
BESIDE = ("range_rate", "height")  # what a log may have beside them

#: Values of the trajectory's `outlier_*` columns.
GOOD, ISOLATED, PATCH, MISSING, REJECTED, ACCEPTED = range(6)  # the last two by hand
#: Of decisions by hand: the channels that they name, their uses, and the columns of their two ends.
CHANNELS = (*COMPONENTS, *BESIDE)
USES = {"auto": GOOD, "bad": REJECTED, "good": ACCEPTED}
ENDS = (("from_s", "to_s"), ("from_row", "to_row"))

#: The readings that an estimate depends on, the fewest first.
PAST, LAGGED = "past readings", "past readings and those of the next {:g} s"
EDITED, WHOLE = "past readings, edited with the whole record", "the whole record"


class Heights(NamedTuple):
    """Heights of the target beside its readings. above_m: (n,) above the ellipsoid or the sea, m, NaN where missing.
    barometric: by the pressure of the air, so that all are off by about the same."""

    above_m: FloatArray
    barometric: bool

    def part(self, rows: slice) -> Heights:
        """Of some of the samples."""
        return self._replace(above_m=self.above_m[rows])


class Line(NamedTuple):
    """A decision by hand. number: of its line in the file. ends: `from_s` and `to_s`, or `from_row` and `to_row`, both
    of which belong to it. station: the one that it is for, or ""."""

    number: int
    component: str
    ends: tuple[str, str]
    first: float
    last: float
    use: str
    station: str = ""
    reason: str = ""

    @property
    def by_row(self) -> bool:
        """Whether it names rows of the log, not times."""
        return self.ends == ENDS[1]


@dataclass(frozen=True)
class Lines:
    """Of a file of decisions by hand. sha256: of its bytes."""

    name: str
    sha256: str
    lines: tuple[Line, ...]


class ByHand(NamedTuple):
    """The decisions on the readings of one log. line: (n, 5) which of the lines, from 1, decides on each reading of
    CHANNELS; 0 for none."""

    decisions: Lines
    line: IntArray

    @property
    def flags(self) -> FlagArray:
        """(n, 3) of COMPONENTS: REJECTED, ACCEPTED, or GOOD where the editor decides."""
        return self._uses(slice(len(COMPONENTS)))

    def of(self, channel: str) -> FlagArray:
        """(n,) the same of one of CHANNELS."""
        return self._uses(CHANNELS.index(channel))

    def _uses(self, columns: int | slice) -> FlagArray:
        uses = np.array([GOOD, *(USES[line.use] for line in self.decisions.lines)], np.uint8)
        found: FlagArray = uses[self.line[:, columns]]
        return found

    def stretch(self, rows: slice) -> ByHand:
        """Those of some rows."""
        return self._replace(line=self.line[rows])


@dataclass(frozen=True, repr=False)
class MeasurementLog:
    """One tracker's log, checked, in SI units and in time order.

    name: what the user called its file. row: (n,) of that, from 0. time_s: (n,) finite, never decreasing; equal times
    are separate measurements. measurement: (n, 3) slant range m, azimuth rad, elevation rad; NaN where missing.
    frame: `local` (x by the log's own convention) or `north-east-up` (azimuth from north).
    rows_in_file, rows_without_time, rows_out_of_order, duplicate_times: counts and row numbers of what was read.
    extra: the other columns of the file, row for row with `time_s`; only if they were asked for. station: what is
    known of the instrument, already applied. epoch: the instant of time zero (ISO 8601) or "".
    remarks: how the file was understood, for the user. understood: the same in full, see `files.reading.understanding`.
    sha256: of the file's bytes, "" if it was none. by_hand: the engineer's decisions on its readings, if there are any.
    heights: of the target, where the log has them instead of elevations. range_rate: (n,) m/s, positive when going away
    or, in some logs, when coming closer. signal_db: (n,) strength of the signal, if asked for. None without.
    """

    name: str
    time_s: FloatArray
    measurement: FloatArray
    row: IntArray
    frame: str = "local"
    rows_in_file: int = 0
    rows_without_time: tuple[int, ...] = ()
    rows_out_of_order: int = 0
    duplicate_times: int = 0
    extra: pa.Table | None = None
    station: Station = field(default_factory=Station)
    epoch: str = ""
    remarks: tuple[str, ...] = ()
    understood: Mapping[str, Any] = field(default_factory=dict)
    sha256: str = ""
    by_hand: ByHand | None = None
    heights: Heights | None = None
    range_rate: FloatArray | None = None
    signal_db: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        zero = f", time zero {self.epoch}" if self.epoch else ""
        return f"<MeasurementLog {self.name}: {_length(self.time_s)}{zero}>"

    def stretch(self, rows: slice) -> MeasurementLog:
        """Some of its rows, in memory; counts and remarks of the whole log stay unchanged."""
        rates, signal = self.range_rate, self.signal_db
        arrays = (np.array(self.time_s[rows]), np.array(self.measurement[rows]), np.array(self.row[rows]))
        forget(self.time_s, self.measurement, self.row)
        extra = None if self.extra is None else self.extra.slice(rows.start, rows.stop - rows.start)
        by_hand = None if self.by_hand is None else self.by_hand.stretch(rows)
        return replace(
            self, time_s=arrays[0], measurement=arrays[1], row=arrays[2], extra=extra, by_hand=by_hand,
            heights=None if self.heights is None else self.heights.part(rows),
            range_rate=None if rates is None else rates[rows], signal_db=None if signal is None else signal[rows],
        )  # fmt: skip


@dataclass(frozen=True, repr=False)
class Truth:
    """A reference trajectory in the station's local frame.

    time_s: (n,) never decreasing. position_m: (n, 3). velocity_mps, acceleration_mps2: (n, 3) or None.
    outlier: (n, 3) non-zero where the log's reading was tampered with, or None.
    """

    name: str
    time_s: FloatArray
    position_m: FloatArray
    velocity_mps: FloatArray | None = None
    acceleration_mps2: FloatArray | None = None
    outlier: FlagArray | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        return f"<Truth {self.name}: {_length(self.time_s)}>"


class Beside(NamedTuple):
    """Readings of a channel beside range, azimuth and elevation: reading, cleaned, residual and residual_sigma (n,) in
    its unit (m/s, m), as in `Diagnostics`; label (n,) as in `Trajectory.outlier`."""

    reading: FloatArray
    cleaned: FloatArray
    residual: FloatArray
    residual_sigma: FloatArray
    label: FlagArray


@dataclass(frozen=True, repr=False)
class Diagnostics:
    """Readings and residuals of a trajectory, row for row with it; not part of its file.

    reading: (n, 3) raw range m, azimuth rad, elevation rad; NaN where missing.
    residual: (n, 3) reading minus its prediction from other readings, NaN where missing: the innovation (from all
    earlier readings), or after smoothing the leave-one-out residual (from all others).
    residual_sigma: (n, 3) 1-sigma that the filter expects of the residual.
    beside: the same of channels in BESIDE that the log has.
    """

    reading: FloatArray
    residual: FloatArray
    residual_sigma: FloatArray
    residual_kind: Literal["innovation", "leave-one-out residual"]
    beside: Mapping[str, Beside] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<Diagnostics: {len(self.reading)} rows, {self.residual_kind}>"


#: What a trajectory is for pandas, pyarrow and notebooks, by the name of its method. `ftproc.api` fills it, and is
#: loaded when one is first asked for.
VIEWS: dict[str, Callable[[Trajectory], Any]] = {}


def _seen_as(name: str, trajectory: Trajectory) -> Any:
    if not VIEWS:
        importlib.import_module("ftproc.api")
    return VIEWS[name](trajectory)


@dataclass(frozen=True, repr=False)
class Trajectory:
    """The result: one row for every row of the log that has a time, in time order.

    row: (n,) row number in the input log. time_s: (n,).
    measurement: (n, 3) cleaned range m, azimuth rad, elevation rad (from the estimate).
    state: (n, 9) x y z m, vx vy vz m/s, ax ay az m/s2. NaN where a method does not estimate it.
    sigma: (n, 9) 1-sigma of the state, in its units.
    measurement_sigma: (n, 3) 1-sigma of the cleaned range m, azimuth rad, elevation rad.
    outlier: (n, 3) GOOD, ISOLATED, PATCH, MISSING, REJECTED or ACCEPTED per component.
    nis: (n,) normalised innovation squared of the components used; NaN if none was.
    correction: (n, 6) correction by the network of position m and velocity m/s.
    metadata: everything needed to compute it again (JSON-serialisable), see the README.
    extra: further columns, row for row. diagnostics, and path_sigma: only of a computed trajectory, not of one read
    from a file. path_sigma: (n, 6) 1-sigma of ground speed m/s, track rad, climb rate m/s, flight path angle rad, turn
    rate rad/s and load factor, see `core.model.kinematics`.
    """

    name: str
    row: IntArray
    time_s: FloatArray
    measurement: FloatArray
    state: FloatArray
    sigma: FloatArray
    measurement_sigma: FloatArray
    outlier: FlagArray
    nis: FloatArray
    correction: FloatArray
    metadata: Mapping[str, Any] = field(default_factory=dict)
    extra: pa.Table | None = None
    diagnostics: Diagnostics | None = None
    path_sigma: FloatArray | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def __repr__(self) -> str:
        settings, summary = (self.metadata.get(name) or {} for name in ("settings", "summary"))
        way = (
            f", {'smoothed' if settings.get('smooth') else 'filtered'} by {self.metadata['method']}" if settings else ""
        )
        trust = summary.get("trust", {}).get("verdict", "")
        return f"<Trajectory {self.name}: {_length(self.time_s)}{way}{', ' if trust else ''}{trust}>"

    def to_pandas(self) -> pd.DataFrame:
        """As a pandas DataFrame, with the columns of its file."""
        found: pd.DataFrame = _seen_as("to_pandas", self)
        return found

    def to_table(self) -> pa.Table:
        """As a pyarrow Table, with the columns and the metadata of its Parquet file."""
        return _seen_as("to_table", self)

    def _repr_html_(self) -> str:
        """For a notebook: the summary, and the track over the ground."""
        found: str = _seen_as("_repr_html_", self)
        return found


def _length(time_s: FloatArray) -> str:
    """Rows and duration, in words."""
    rows = f"{len(time_s)} row{'' if len(time_s) == 1 else 's'}"
    return f"{rows}, {time_s[-1] - time_s[0]:.6g} s" if len(time_s) else rows


def forget(*arrays: NDArray[Any]) -> None:
    """Release the memory of arrays that are mapped from disk; they stay valid."""
    for array in arrays:
        mapped = getattr(array, "_mmap", None)
        if mapped is not None and hasattr(mmap, "MADV_DONTNEED"):
            mapped.madvise(mmap.MADV_DONTNEED)
