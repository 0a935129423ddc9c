"""Positions of the target in: GNSS on board, ADS-B, a reference trajectory in geodetic form.

They are latitude, longitude and height above the ellipsoid, or x, y, z in m in the frame of the range.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ftproc.errors import InputError
from ftproc.files.reading.clocks.times import seconds
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.header import TableHeader
from ftproc.files.reading.meaning.names import taken_apart
from ftproc.files.reading.meaning.numbers import Origin, numbers
from ftproc.files.reading.meaning.questions import listed
from ftproc.files.units import Unit, unit_named
from ftproc.records import FloatArray, IntArray

if TYPE_CHECKING:
    import pyarrow as pa

GEODETIC, LOCAL = ("lat_deg", "lon_deg", "height_m"), ("x_m", "y_m", "z_m")
_NAMES: Mapping[str, tuple[str, ...]] = {
    "lat_deg": ("lat", "latitude"),
    "lon_deg": ("lon", "long", "lng", "longitude"),
    "height_m": ("height", "altitude", "alt", "geoheight", "geoaltitude", "hae", "ellipsoidalheight"),
    "x_m": ("x", "east"),
    "y_m": ("y", "north"),
    "z_m": ("z", "up"),
}


#: Columns that state an accuracy: a category of navigation accuracy, or a length or a dilution of precision.
_ACCURACY: Mapping[str, tuple[str, ...]] = {
    "category": ("nacp", "nac_p", "nac"),
    "number": ("sigma", "accuracy", "hacc", "eph", "epu", "hdop", "pdop"),
}
#: Estimated position uncertainty, 95 %, m, of NACp 0 (unknown) to 11 (DO-260B, table 2-71).
NACP_M = (37040.0, 18520.0, 7408.0, 3704.0, 1852.0, 926.0, 555.6, 185.2, 92.6, 30.0, 10.0, 3.0)


class Positions(NamedTuple):
    """time_s (n,), in order; place (n, 3) latitude deg, longitude deg, height m, or x, y, z m, NaN where missing; which
    of the two; the row (n,) of the file of each, the number of its rows, the instant of time zero or "", and its
    SHA-256. accuracy: (n,) as a column states it, in m or relative; None without."""

    name: str
    time_s: FloatArray
    place: FloatArray
    geodetic: bool
    row: IntArray
    rows_in_file: int
    epoch: str
    sha256: str
    accuracy: FloatArray | None = None


def is_geodetic(header: TableHeader) -> bool:
    """Whether a table has latitudes and longitudes, but no x, y, z."""
    return not set(LOCAL) <= set(header.names) and all(_index_of(header, name) is not None for name in GEODETIC[:2])


def read(source: tables.Source, stated: Mapping[str, str] | None = None) -> Positions:
    """The positions of a file, as `logs.read` takes it. stated: names of columns by quantity: time, lat_deg, ... Raises
    InputError for a column that is missing, and a cell that is no number."""
    header, stated = tables.read_header(source), stated or {}
    geodetic = is_geodetic(header) or any(name in stated for name in GEODETIC)
    wanted = GEODETIC if geodetic else LOCAL
    indices = [_needed(header, name, stated.get(name, "")) for name in wanted]
    clock = _time(header, stated.get("time", ""))
    table = header.load([], [clock, *indices])
    if table.num_rows == 0:
        raise InputError(f"{header.source}: there are column names but no rows.")
    unit = unit_named("time", taken_apart(header.names[clock]).unit) or Unit("s")
    time_s, epoch = seconds(table.column(0), _origin(header, clock, "seconds or an ISO-8601 timestamp"), unit.to_si)
    position = np.column_stack([_values(header, at, table.column(k + 1), wanted[k]) for k, at in enumerate(indices)])
    timed = np.flatnonzero(np.isfinite(time_s))
    row = timed[np.argsort(time_s[timed], kind="stable")]
    if geodetic and (np.abs(position[:, 0]) > 90).any():
        bad = int(np.argmax(np.abs(position[:, 0]) > 90))
        raise InputError(f"{header.source}: row {bad}: a latitude lies in -90..90 degrees; correct the cell.")
    stated_m = _accuracy(header)
    return Positions(
        header.source, time_s[row], position[row], geodetic, row.astype(np.int64), len(time_s), epoch, header.sha256(),
        None if stated_m is None else stated_m[row],
    )  # fmt: skip


def _accuracy(header: TableHeader) -> FloatArray | None:
    """(n,) what the first column that states an accuracy says of each position."""
    for kind, names in _ACCURACY.items():
        for index, name in enumerate(header.names):
            if {taken_apart(name).stem, taken_apart(name).core()} & {*names}:
                values = numbers(header.load([], [index]).column(0), _origin(header, index, "a number"))
                if kind == "category":
                    known = np.clip(np.where(np.isfinite(values), values, 0.0), 0, len(NACP_M) - 1).astype(int)
                    radii: FloatArray = np.array(NACP_M)[known]
                    return radii
                good = np.isfinite(values) & (values > 0)
                return np.where(good, values, np.nanmax(values, where=good, initial=1.0))
    return None


def _index_of(header: TableHeader, name: str) -> int | None:
    """The column of a quantity: by its own name, or one of its other ones."""
    if name in header.names:
        return header.names.index(name)
    apart = [taken_apart(each) for each in header.names]
    fits = [k for k, each in enumerate(apart) if each.stem in _NAMES[name] or each.core() in _NAMES[name]]
    return fits[0] if len(fits) == 1 else None


def _needed(header: TableHeader, name: str, stated: str) -> int:
    index = header.names.index(stated) if stated in header.names else None if stated else _index_of(header, name)
    if index is None:
        raise InputError(
            f"{header.source}: there is no column for {stated or name}. Its columns are: {listed(header.names)}. "
            "Positions are lat_deg, lon_deg, height_m, or x_m, y_m, z_m; rename the right ones."
        )
    return index


def _time(header: TableHeader, stated: str) -> int:
    if stated in header.names:
        return header.names.index(stated)
    for names in (["time_s"], [each for each in header.names if taken_apart(each).means("time") == 1]):
        if len(set(names) & set(header.names)) == 1:
            return header.names.index(names[0])
    raise InputError(
        f"{header.source}: no column, or more than one, is the time. Its columns are: {listed(header.names)}. Rename "
        "it to time_s."
    )


def _origin(header: TableHeader, index: int, expected: str) -> Origin:
    return Origin(header.source, header.names[index], expected, header.decimal_comma)


def _values(header: TableHeader, index: int, column: pa.ChunkedArray, name: str) -> FloatArray:
    """(n,) in degrees or m."""
    values = numbers(column, _origin(header, index, "a number"))
    unit = taken_apart(header.names[index]).unit or name.rpartition("_")[2]
    if name not in GEODETIC[:2]:
        return (unit_named("height", unit) or Unit("m")).to_si(values)
    angle = unit_named("azimuth", unit)
    return values if angle is None or angle.name == "deg" else np.degrees(angle.to_si(values))


def local(position: FloatArray, origin: Sequence[float]) -> FloatArray:
    """(n, 3) latitude deg, longitude deg, height m -> (n, 3) east, north, up m at an origin of the same kind."""
    from ftproc.core.model import earth

    start = (float(origin[0]), float(origin[1]), float(origin[2]))
    there = np.ascontiguousarray(earth.earth_centred(position.T).T)
    found: FloatArray = (there - earth.earth_centred(start)) @ earth.verticals(start).T
    return found
