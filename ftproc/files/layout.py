"""The files that the program writes: names of columns, and kinds of file by the ending of the name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from ftproc.files import remote
from ftproc.files.units import si_unit
from ftproc.files.words import QUANTITIES
from ftproc.records import COMPONENTS

Target = str | Path

#: Columns of a log, by quantity: `time_s`, `range_m`, `azimuth_rad`, `elevation_rad`.
CANONICAL: Mapping[str, str] = {quantity: f"{quantity}_{si_unit(quantity).name}" for quantity in QUANTITIES}

#: Units of what is measured beside the readings, by quantity.
BESIDE: Mapping[str, str] = {quantity: si_unit(quantity).name for quantity in ("range_rate", "height")}
POSITION = ("x_m", "y_m", "z_m")
VELOCITY = ("vx_mps", "vy_mps", "vz_mps")
ACCELERATION = ("ax_mps2", "ay_mps2", "az_mps2")
OUTLIER = ("outlier_range", "outlier_azimuth", "outlier_elevation")
MEASUREMENT = tuple(CANONICAL[component] for component in COMPONENTS)
STATE = (*POSITION, *VELOCITY, *ACCELERATION)
SIGMA = tuple(f"sigma_{name}" for name in STATE)
MEASUREMENT_SIGMA = tuple(f"sigma_{name}" for name in MEASUREMENT)
CORRECTION = tuple(f"correction_{name}" for name in (*POSITION, *VELOCITY))

#: Every column a trajectory always has, in the order in which it is written.
TRAJECTORY = ("row", "time_s", *MEASUREMENT, *STATE, *SIGMA, *MEASUREMENT_SIGMA, *OUTLIER, "nis", *CORRECTION)

_UNITS = {"_s": "s", "_m": "m", "_rad": "rad", "_mps": "m/s", "_mps2": "m/s2", "_deg": "deg"}
_MEANINGS = {
    "row": "row of the log, counted from 0 without the header",
    "time_s": "time as read",
    **dict.fromkeys(MEASUREMENT, "cleaned reading, from the estimate"),
    **dict.fromkeys(POSITION, "estimated position in the local frame"),
    **dict.fromkeys(VELOCITY, "estimated velocity in the local frame"),
    **dict.fromkeys(ACCELERATION, "estimated acceleration in the local frame"),
    **{name: f"1-sigma of {name.removeprefix('sigma_')}" for name in (*SIGMA, *MEASUREMENT_SIGMA)},
    **dict.fromkeys(
        OUTLIER, "0 good, 1 isolated outlier, 2 patch outlier, 3 missing, 4 rejected by hand, 5 accepted by hand"
    ),
    "nis": "normalised innovation squared of the components used",
    **dict.fromkeys(CORRECTION, "added by the learned correction; estimate minus correction is the plain filter"),
    "stations": "stations with a used reading near this time",
    "lat_deg": "geodetic latitude, WGS-84",
    "lon_deg": "longitude, WGS-84",
    "height_m": "height above the WGS-84 ellipsoid",
    **{f"{axis}_ecef_m": "earth-centred, earth-fixed position" for axis in "xyz"},
    **{f"v{axis}_ecef_mps": "earth-centred, earth-fixed velocity" for axis in "xyz"},
}


def described(column: str) -> dict[str, str]:
    """Unit and description of a column of a trajectory, for the metadata of its field; empty for another's."""
    if column not in _MEANINGS:
        return {}
    unit = next((unit for ending, unit in _UNITS.items() if column.endswith(ending)), "1")
    return {"unit": unit, "description": _MEANINGS[column]}


#: Key of the metadata in a Parquet file.
METADATA_KEY = b"ftproc"

#: Endings of the names of tables and of maps.
TABLES = (".csv", ".csv.gz", ".parquet", ".feather")
PACKED = (".gz", ".bz2", ".xz", ".zst", ".zip")  # of logs
MAPS = (".kml", ".geojson", ".czml")


def table_kind(name: Target) -> str | None:
    """The one of TABLES that `name` ends in, in any case, or None."""
    return ending(name, TABLES)


def map_kind(name: Target) -> str | None:
    """The one of MAPS that `name` ends in, in any case, or None."""
    return ending(name, MAPS)


def stem_and_kind(log: str) -> tuple[str, str]:
    """The name of a log without its endings, and the last of these that is not one of packing: flight.csv.gz, .csv."""
    path = Path(log.partition("#")[0])
    if path.suffix.lower() in PACKED and path.stem:
        path = Path(path.stem)
    return path.stem, path.suffix.lower()


def ending(name: Target, kinds: Iterable[str]) -> str | None:
    """The one of `kinds`, such as `.csv`, that `name` ends in, in any case, or None."""
    file = Path(name).name.lower()
    return next((kind for kind in kinds if file.endswith(kind)), None)


def sidecar(trajectory: Target) -> Target | None:
    """The file of a trajectory's metadata: `out.json` for `out.csv`, `out.kml` and such; None for Parquet and Feather,
    which hold their own, and for `-`."""
    kind = None if str(trajectory) == "-" else table_kind(trajectory) or map_kind(trajectory)
    if kind in (None, ".parquet", ".feather"):
        return None
    if remote.is_uri(trajectory):
        return str(trajectory)[: -len(str(kind))] + ".json"
    path = Path(trajectory)
    return path.with_name(path.name[: -len(str(kind))] + ".json")
