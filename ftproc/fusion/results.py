"""A fused flight as tables: the trajectory, each station's edited log, the biases; and these in station files."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ftproc.config import writing
from ftproc.core import beside
from ftproc.core.model import stations as geometry
from ftproc.core.model.frames import wrap
from ftproc.errors import OutputError
from ftproc.files import arrow, layout, remote
from ftproc.files.conventions import axis
from ftproc.files.writing import atomic, outputs
from ftproc.files.writing.outputs import Output
from ftproc.fusion.estimation import constants as posterior
from ftproc.fusion.estimation.constants import Constants
from ftproc.fusion.estimation.events import CLOCK
from ftproc.fusion.estimation.whole import Fused
from ftproc.fusion.range_file import POSITION, Instrument, Range
from ftproc.methods.preparing import labels
from ftproc.quality import by_hand
from ftproc.records import COMPONENTS, MISSING, FloatArray, MeasurementLog, Trajectory

if TYPE_CHECKING:
    import pyarrow as pa

_HEAD = "# Biases, reading minus truth, and the time to add, as a fused flight has shown them.\n"  # of a station file
SENSE = {"x": "anticlockwise", "north": "clockwise"}  # of the azimuth
UNSEEN_S, UNSEEN_INTERVALS = 1.0, 2.5  # since its last used reading, until a station no longer counts as used
#: Columns of a trajectory of one station that a fused one lacks.
WITHOUT = ("row", *layout.MEASUREMENT, *layout.MEASUREMENT_SIGMA, *layout.OUTLIER, *layout.CORRECTION)


def stations_used(fused: Fused) -> FloatArray:
    """(m,) how many stations have a used reading within a few of their intervals of each distinct time."""
    times = fused.track.time_s
    count = np.zeros(len(times))
    for s, station in enumerate(fused.stations):
        used = (station.time_s - fused.constants.estimate[s, CLOCK])[(fused.weight[s] > 0).any(1)]
        if len(used) < 2:
            continue
        near = max(UNSEEN_S, UNSEEN_INTERVALS * float(np.median(np.diff(used))))
        after = np.clip(np.searchsorted(used, times), 1, len(used) - 1)
        away = np.minimum(np.abs(times - used[after - 1]), np.abs(used[after] - times))
        count += away <= near
    return count


def edited(fused: Fused, s: int, log: MeasurementLog, instrument: Instrument) -> pa.Table:
    """A row for each row of a station's log, in its order and in its sense of the azimuth. Rows without a time are
    missing. The cleaned reading is what the station would have read: its biases are in it. One that gives positions has
    these too, beside the ranges and angles of the place from which they are seen."""
    station, biases = fused.stations[s], fused.constants.estimate[s]
    cleaned = geometry.measured(fused.position[s], station.place, fused.axes[s]) + biases[:3]
    near = np.where(np.isfinite(station.measurement[:, 1]), station.measurement[:, 1], 0.0)
    cleaned[:, 1] = near + wrap(cleaned[:, 1] - near)
    residual, variance = fused.residual[s].copy(), fused.residual_variance[s]
    label = by_hand.labelled(labels(fused.weight[s], station.measurement), log.by_hand)
    if log.frame == "north-east-up":
        cleaned[:, 1], residual[:, 1] = math.pi / 2 - cleaned[:, 1], -residual[:, 1]
        reading = np.where(np.isfinite(log.measurement[:, 1]), log.measurement[:, 1], math.pi)
        cleaned[:, 1] = reading + wrap(cleaned[:, 1] - reading)
    absent = [c for c in range(3) if c not in station.components]
    cleaned[:, absent] = np.nan
    rows = max(log.rows_in_file, int(log.row.max()) + 1)

    def full(values: NDArray[Any], fill: float = np.nan) -> NDArray[Any]:
        found = np.full((rows, *values.shape[1:]), fill, values.dtype)
        found[log.row] = values
        return found

    columns: dict[str, Any] = {
        "row": np.arange(rows),
        "time_s": full(log.time_s),
        "true_time_s": full(log.time_s - biases[CLOCK]),
    }
    units = ("m", "rad", "rad")
    for c, name in enumerate(layout.MEASUREMENT):
        columns[name] = full(cleaned[:, c])
    for c, (component, unit) in enumerate(zip(COMPONENTS, units, strict=True)):
        columns[f"residual_{component}_{unit}"] = full(residual[:, c])
        columns[f"residual_sigma_{component}_{unit}"] = full(np.sqrt(variance[:, c]))
    for c, name in enumerate(layout.OUTLIER):
        columns[name] = full(label[:, c], MISSING)
    for name, each in fused.beside[s].items() if fused.beside else ():
        unit = layout.BESIDE[name]
        columns[f"{name}_{unit}"] = full(each.cleaned)
        columns[f"residual_{name}_{unit}"] = full(each.residual)
        columns[f"residual_sigma_{name}_{unit}"] = full(np.sqrt(each.variance))
        columns[f"outlier_{name}"] = full(beside.labels_of(each.side.weight, each.side.value), MISSING)
    if instrument.kind == POSITION:
        columns |= {name: full(fused.position[s][:, c]) for c, name in enumerate(layout.POSITION)}
        columns["outlier_position"] = full(np.where((label == MISSING).any(1), MISSING, label.max(1)), MISSING)
    return arrow.table(columns)


def residuals(table: pa.Table, log: MeasurementLog, noise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """(n, 3) residuals and their sigmas of the readings of a log from its edited table; those of readings rejected by
    hand, which the estimate has not seen, are about it. noise: (3,) 1-sigma."""
    units = zip(COMPONENTS, ("m", "rad", "rad"), strict=True)
    names = [(f"residual_{each}_{unit}", f"residual_sigma_{each}_{unit}") for each, unit in units]
    residual, sigma, cleaned = (
        np.column_stack([arrow.to_numpy(table.column(name))[log.row] for name in of])
        for of in (*zip(*names, strict=True), layout.MEASUREMENT)
    )
    rejected = np.isnan(residual)
    off = log.measurement - cleaned
    off[:, 1] = wrap(off[:, 1])
    return np.where(rejected, off, residual), np.where(rejected, noise, sigma)


def edited_alone(found: Trajectory, log: MeasurementLog) -> pa.Table:
    """The same of a single station."""
    rows = max(log.rows_in_file, int(log.row.max()) + 1)
    diagnostics = found.diagnostics
    assert diagnostics is not None

    def full(values: NDArray[Any], fill: float = np.nan) -> NDArray[Any]:
        made = np.full(rows, fill, values.dtype)
        made[found.row] = values
        return made

    columns: dict[str, Any] = {"row": np.arange(rows), "time_s": full(found.time_s), "true_time_s": full(found.time_s)}
    for c, name in enumerate(layout.MEASUREMENT):
        columns[name] = full(found.measurement[:, c])
    for c, (component, unit) in enumerate(zip(COMPONENTS, ("m", "rad", "rad"), strict=True)):
        columns[f"residual_{component}_{unit}"] = full(diagnostics.residual[:, c])
        columns[f"residual_sigma_{component}_{unit}"] = full(diagnostics.residual_sigma[:, c])
    for c, name in enumerate(layout.OUTLIER):
        columns[name] = full(found.outlier[:, c], MISSING)
    return arrow.table(columns)


def biases(constants: Constants, names: list[str]) -> pa.Table:
    """A row for each parameter that was not known beforehand."""
    station, parameter = np.nonzero(constants.prior > 0)
    figures = {"estimate": constants.estimate, "sigma": constants.sigma, "prior_sigma": constants.prior}
    return arrow.table(
        {
            "station": np.array(names)[station],
            "parameter": np.array(posterior.NAMES)[parameter],
            **{name: each[station, parameter] for name, each in figures.items()},
            "observable": constants.observable[station, parameter],
        }
    )


class Places(NamedTuple):
    """The files of a fused flight beside its trajectory. edited, calibration: by station; none without stations' files
    to write. folders: their directories."""

    biases: str | None
    edited: Mapping[str, str]
    calibration: Mapping[str, str]
    folders: tuple[str, ...]


def places(range_: Range, output: str, folder: str | None) -> Places:
    """Where they go, by the name of the trajectory. folder: of the station files, if there are any. Raises
    OutputError."""
    names = [instrument.name for instrument in range_.instruments]
    trackers = [each.name for each in range_.instruments if each.kind != POSITION]
    calibration = {} if folder is None else {name: remote.within(folder, f"{name}.toml") for name in trackers}
    folders = () if folder is None else (folder,)
    if output == outputs.STREAM:
        return Places(None, {}, calibration, folders)
    kind = layout.table_kind(output) or layout.map_kind(output) or ""
    stem = output[: len(output) - len(kind)]
    own = f"{stem}.edited"
    if (path := remote.local(own)) is not None and path.is_symlink():
        raise OutputError(
            f"{own}: this is a symbolic link, and the edited logs go into a directory of that name. Delete it, or give "
            "another name with -o."
        )
    return Places(f"{stem}.biases.csv", {name: f"{own}/{name}.parquet" for name in names}, calibration, (own, *folders))


def written(found: Places) -> list[Output]:
    """These files, for the check of all outputs."""
    return [
        *([Output(found.biases, ours=(b"station,parameter,",))] if found.biases is not None else []),
        *(Output(name, made=True, ours=(b"PAR1",)) for name in found.edited.values()),
        *(Output(name, "--write-calibration", True, (_HEAD.encode(),)) for name in found.calibration.values()),
    ]


def write_calibration(range_: Range, constants: Constants, files: Mapping[str, str]) -> None:
    """A station file for each station: what it had, with the observable biases added and its clock set right.

    A station file has no tilts; what is seen of them in the readings of other flights depends on the direction.
    """
    for s, instrument in enumerate(range_.instruments):
        if instrument.name not in files:
            continue
        with atomic.replacing(files[instrument.name]) as stream:
            stream.write(calibration(instrument, constants, s).encode())


def calibration(instrument: Instrument, constants: Constants, s: int) -> str:
    """The station file with the biases of a flight."""
    options = dict(instrument.options)
    estimate, observed = constants.estimate[s], constants.observable[s]
    station = instrument.recipe.station
    sense = -1.0 if (station.azimuth_sense or SENSE[axis(station)]) == "clockwise" else 1.0
    zenith = -1.0 if station.elevation_from == "zenith" else 1.0
    before = options.get("bias") or (0.0, 0.0, 0.0)
    signs = (1.0, sense, zenith)  # in the sense of the readings as they are written
    options["bias"] = tuple(before[c] + signs[c] * float(estimate[c]) if observed[c] else before[c] for c in range(3))
    if observed[CLOCK]:
        options["time_offset_s"] = options.get("time_offset_s", 0.0) - float(estimate[CLOCK])
    if instrument.site is not None:
        options.setdefault("site", instrument.site)
    head = _HEAD
    if observed[3:CLOCK].any():
        tilts = " and ".join(
            f"{1e3 * estimate[3 + j]:.4g} mrad about {axis}"
            for j, axis in enumerate(("east", "north"))
            if observed[3 + j]
        )
        head += f"# Tilts, which a station file does not hold: {tilts}.\n"
    assert all(math.isfinite(value) for value in options["bias"])
    return head + writing.dump(options)
