"""A simulated flight for several stations out: the range file, the logs, and the truth of each."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from ftproc.errors import OutputError
from ftproc.files import arrow
from ftproc.files.writing import atomic, flights, outputs, tables
from ftproc.files.writing.outputs import Output
from ftproc.records import MeasurementLog, Truth
from ftproc.simulation.ranges import SimulatedRange, SimulatedStation

_GNSS = "gnss.csv"
_PARAMETERS = ("range_m", "azimuth_rad", "elevation_rad", "tilt_east_rad", "tilt_north_rad", "clock_s")


def write(simulated: SimulatedRange, directory: str, truth: str | None) -> None:
    """Write range.toml and the STATION.csv of each station into a directory, which is made.

    truth: file of the flight in the frame of the range. With it come, in the directory, STATION.truth.csv, the flight
    in the station's own axes with the codes of its outliers, and beside it NAME.biases.csv, what was drawn.
    Raises OutputError, UsageError."""
    folder = Path(directory)
    if folder.suffix or directory == "-":
        raise OutputError(f"{directory}: a range file and several logs are written; name a directory with -o.")
    outputs.check(_written(simulated, folder, truth), [])
    if truth is not None:
        flights.write_truth(simulated.truth, truth)
        _write_biases(simulated, truth)
    for station in simulated.stations:
        log, seen = _as_counted(station)
        flights.write_log(log, str(folder / f"{station.name}.csv"), azimuth_from=station.azimuth_from)
        if truth is not None:
            flights.write_truth(seen, str(folder / f"{station.name}.truth.csv"))
    if simulated.gnss is not None:
        names = ("time_s", "lat_deg", "lon_deg", "height_m")
        columns = (simulated.gnss.time_s, *np.ascontiguousarray(simulated.gnss.place.T))
        tables.write_table(arrow.table(dict(zip(names, columns, strict=True))), str(folder / _GNSS))
    with atomic.replacing(folder / "range.toml") as stream:
        stream.write(range_file(simulated).encode())


def _written(simulated: SimulatedRange, folder: Path, truth: str | None) -> list[Output]:
    kinds = (".csv",) if truth is None else (".csv", ".truth.csv")
    names = ["range.toml", *(f"{station.name}{kind}" for station in simulated.stations for kind in kinds)]
    names += [_GNSS] if simulated.gnss is not None else []
    found = [Output(folder / name, made=True) for name in names]
    return found if truth is None else [*found, *(Output(name, "--truth") for name in (truth, _biases(truth)))]


def _biases(truth: str) -> str:
    path = Path(truth)
    return str(path.with_name(f"{path.name.split('.')[0]}.biases.csv"))


def _as_counted(station: SimulatedStation) -> tuple[MeasurementLog, Truth]:
    """The log and its truth as the station counts: with the azimuth from north, x is north and y east."""
    log, truth = station.log, station.truth
    if station.azimuth_from != "north":
        return log, truth
    turned = log.measurement.copy()
    turned[:, 1] = math.pi / 2 - turned[:, 1]
    assert truth.velocity_mps is not None
    assert truth.acceleration_mps2 is not None
    states = (truth.position_m, truth.velocity_mps, truth.acceleration_mps2)
    position, velocity, acceleration = (each[:, [1, 0, 2]] for each in states)
    seen = replace(truth, position_m=position, velocity_mps=velocity, acceleration_mps2=acceleration)
    return replace(log, measurement=turned), seen


def range_file(simulated: SimulatedRange) -> str:
    """The text of the range file: what a user would know beforehand."""
    names = ("lat_deg", "lon_deg", "height_m")
    origin = "".join(f"{name} = {value!r}\n" for name, value in zip(names, simulated.origin, strict=True))
    sections = "".join(_section(station) for station in simulated.stations)
    gnss = f'\n[station.gnss]\nkind = "position"\nlog = "{_GNSS}"\n' if simulated.gnss is not None else ""
    return f"[origin]\n{origin}{sections}{gnss}"


def _section(station: SimulatedStation) -> str:
    lines = [f'log = "{station.name}.csv"']
    lines += [f"{name} = {v!r}" for name, v in zip(("lat_deg", "lon_deg", "height_m"), station.site, strict=True)]
    if station.prior[1] > 0:
        lines.append(f'azimuth_from = "{station.azimuth_from}"')
    keys = (("range_bias_sigma_m", 0, 1.0), ("azimuth_bias_sigma_mrad", 1, 1e3), ("elevation_bias_sigma_mrad", 2, 1e3))
    for key, j, scale in (*keys, ("level_sigma_mrad", 3, 1e3)):
        if station.prior[j] > 0:
            lines.append(f"{key} = {scale * station.prior[j]:g}")
    lines.append(f"clock_offset_sigma_s = {station.prior[5]:g}")
    return f"\n[station.{station.name}]\n" + "\n".join(lines) + "\n"


def _write_biases(simulated: SimulatedRange, truth: str) -> None:
    import pyarrow as pa

    rows = [
        (station.name, name, float(station.biases[j]))
        for station in simulated.stations
        for j, name in enumerate(_PARAMETERS)
        if station.prior[j] > 0
    ]
    columns = list(zip(*rows, strict=True))
    table = pa.table([pa.array(c) for c in columns], names=["station", "parameter", "true"])
    tables.write_table(table, _biases(truth))
