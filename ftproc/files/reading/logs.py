"""Logs in: a file, standard input or a table -> a checked `MeasurementLog`."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from ftproc.errors import InputError
from ftproc.files import conventions
from ftproc.files.reading import cells, large, schema, tables, values
from ftproc.files.reading.header import OpenTable
from ftproc.files.units import UNITS, parse_units
from ftproc.records import COMPONENTS, FloatArray, MeasurementLog
from ftproc.settings import Station

if TYPE_CHECKING:
    import pyarrow as pa

#: Half of all readings beyond these (rad): no flight but a mistaken unit. Single wild readings are for editing.
_PLAUSIBLE_MEDIAN = {"azimuth": 4 * math.pi, "elevation": math.pi / 2, "zenith angle": math.pi}


def read(
    source: tables.Source,
    *,
    units: str | Mapping[str, str] | None = None,
    columns: str | Mapping[str, str] | None = None,
    azimuth_from: str | None = None,
    keep_columns: bool = False,
    station: Station | None = None,
) -> MeasurementLog:
    """Read and check one log; angles become rad, lengths m, times s, rows come in time order.

    source: path of a .csv, .csv.gz, .parquet or .feather file, `-` for CSV on standard input, a pyarrow Table or a
    pandas DataFrame. units: such as `{"range": "km"}` or `"range=km,azimuth=deg"`, for columns whose name
    states no unit.
    columns: such as `{"time": "T0"}` or `"time=T0,range=RNG"`; `none` for a quantity the file has not.
    azimuth_from: `x` (A = atan2(y, x), the default) or `north`, which makes the frame `north-east-up`.
    keep_columns: carry the file's other columns through as `extra`.
    station: what else is known of the instrument, see `conventions`.

    Rows are counted from 0, the header not among them, in messages as in `row`; empty lines do not count.
    Rows without a time are listed and left out; readings of whatever size stay in (a negative range is for
    the editing to judge). Timestamps become seconds since 00:00 UTC of the day of the earliest one.

    Raises InputError for a file that cannot be read or is no log, UsageError for options that are not
    understood.
    """
    station = station or Station()
    if azimuth_from is not None:
        station = replace(station, azimuth_from=azimuth_from)
    conventions.check(station)
    unit_of, column_of = parse_units(units), schema.parse_columns(columns)
    opened = tables.open_table(source)
    found = schema.resolve(opened.source, opened.names, unit_of, column_of)
    wanted = [column.position for column in found.values()]
    others = [place for place in range(len(opened.names)) if keep_columns and place not in wanted]
    _check_others(opened, others)
    in_blocks = not others and station.refraction is None  # which needs the distance where none was read
    if in_blocks and (blocks := opened.blocks(wanted)) is not None:
        read_so = large.read(opened.source, blocks, partial(_converted, opened, found), station)
        if read_so is not None:
            log, quantities, sample = read_so
            _check_units(opened.source, quantities, found, station.elevation_from)
            remarks = schema.remarks(opened.names, found, bool(log.epoch))
            understood = conventions.apply(replace(sample, remarks=remarks), station)
            return replace(log, frame=understood.frame, station=station, remarks=understood.remarks)
    table = opened.load(wanted, others)
    if table.num_rows == 0:
        raise InputError(f"{opened.source}: there are column names but no rows.")
    quantities, epoch = _converted(opened, found, table)
    _check_units(opened.source, quantities, found, station.elevation_from)
    extra = table.select(list(range(len(wanted), table.num_columns))) if others else None
    log = _in_time_order(opened.source, quantities, extra)
    log = replace(log, epoch=epoch, remarks=schema.remarks(opened.names, found, bool(epoch)))
    return conventions.apply(log, station)


def _converted(
    opened: OpenTable, found: Mapping[str, schema.Column], table: pa.Table
) -> tuple[dict[str, FloatArray], str]:
    """The quantities in SI units, time first, and the midnight that the times count from (or "")."""
    time_s, epoch = _time(table.column(0), found["time"], opened)
    others = {
        quantity: _quantity(table.column(index), column, opened)
        for index, (quantity, column) in enumerate(found.items())
        if quantity != "time"
    }
    return {"time": time_s} | others, epoch


def _check_others(opened: OpenTable, others: list[int]) -> None:
    counts = Counter(opened.names[position] for position in others)
    for name, count in counts.items():
        if count > 1:
            raise InputError(
                f'{opened.source}: column "{name}" is there twice, so both cannot be kept; rename one, '
                "or leave --keep-columns out."
            )


def _time(column: pa.ChunkedArray, found: schema.Column, opened: OpenTable) -> tuple[FloatArray, str]:
    expected = f"a time in {found.unit.name} or an ISO-8601 timestamp"
    return values.seconds(
        column, cells.Origin(opened.source, found.name, expected, opened.decimal_comma), found.unit.to_si
    )


def _quantity(column: pa.ChunkedArray, found: schema.Column, opened: OpenTable) -> FloatArray:
    article = "an" if found.quantity in ("azimuth", "elevation") else "a"
    origin = cells.Origin(
        opened.source, found.name, f"{article} {found.quantity} in {found.unit.name}", opened.decimal_comma
    )
    return found.unit.to_si(values.numbers(column, origin))


def _check_units(
    source: str, quantities: Mapping[str, FloatArray], found: Mapping[str, schema.Column], elevation_from: str
) -> None:
    """Raise InputError when the angles cannot be in the unit assumed. A unit the user named is believed."""
    for quantity in ("azimuth", "elevation"):
        what = "zenith angle" if (quantity, elevation_from) == ("elevation", "zenith") else quantity
        limit = _PLAUSIBLE_MEDIAN[what]
        angles = np.abs(quantities.get(quantity, np.empty(0)))
        angles = angles[~np.isnan(angles)]
        if not angles.size or found[quantity].unit_stated_by_user:
            continue
        with np.errstate(over="ignore"):  # what overflows is no angle either
            half, most = np.quantile(angles, [0.5, 0.99]).tolist()
        if half <= limit:
            continue
        column = found[quantity]
        assumed = column.unit
        half, most = (value * assumed.divide / assumed.multiply for value in (half, most))
        # Degrees end at 360; what is beyond 400 is wild and says nothing.
        typical = most if quantity == "azimuth" and 370 < most <= 400 else half
        other = _likely_unit(quantity, typical, limit / (2 if quantity == "azimuth" else 1))  # one turn, straight up
        named = f"--columns {quantity}={column.name} " if column.unit_in_name else ""
        raise InputError(
            f'{source}: half of column "{column.name}" lies beyond {half:.4g} {assumed.name}, which is no '
            f"{what}: it looks like {other[1]}; use {named}--units {quantity}={other[0]}"
            f"{_and_the_other_angle(quantity, found, other[0])}. "
            f"If {assumed.name} is right, say {named}--units {quantity}={assumed.name}."
        )


def _likely_unit(quantity: str, typical: float, limit: float) -> tuple[str, str]:
    words = {"deg": "degrees (or gon)", "grad": "gradians (gon)", "mil": "mils"}
    for name, word in words.items():
        unit = UNITS[quantity][name]
        if typical * unit.multiply / unit.divide <= limit:
            return name, word
    return "UNIT", "another unit"


def _and_the_other_angle(quantity: str, found: Mapping[str, schema.Column], unit: str) -> str:
    """An elevation of a few degrees passes for radians, so a wrong azimuth is a reason to look at it too."""
    other = found.get("elevation" if quantity == "azimuth" else "azimuth")
    if other is None or other.unit_stated_by_user or other.unit != found[quantity].unit:
        return ""
    return f" (and {other.quantity}={unit} if that is so too)"


def _in_time_order(source: str, quantities: Mapping[str, FloatArray], extra: pa.Table | None) -> MeasurementLog:
    time = quantities["time"]
    measurement = np.full((len(time), len(COMPONENTS)), np.nan)
    for index, component in enumerate(COMPONENTS):
        if component in quantities:
            measurement[:, index] = quantities[component]
    timed = np.flatnonzero(~np.isnan(time))
    if not timed.size:
        raise InputError(f"{source}: no row has a time, so there is nothing to process; fill the times in.")
    if np.isnan(measurement[timed]).all():
        raise InputError(
            f"{source}: no row has a range, azimuth or elevation, so there is nothing to process; check the columns."
        )
    late = int(np.count_nonzero(time[timed] < np.maximum.accumulate(time[timed])))
    row = timed[np.argsort(time[timed], kind="stable")] if late else timed
    everything = len(row) == len(time) and not late
    return MeasurementLog(
        name=source,
        time_s=np.array(time[row]),
        measurement=measurement if everything else measurement[row],
        row=row.astype(np.int64),
        rows_in_file=len(time),
        rows_without_time=tuple(np.flatnonzero(np.isnan(time)).tolist()),
        rows_out_of_order=late,
        duplicate_times=int(np.count_nonzero(time[row][1:] == time[row][:-1])),
        extra=extra if extra is None or everything else extra.take(row),
    )
