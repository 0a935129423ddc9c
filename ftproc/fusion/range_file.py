"""The range file: the stations of a test range, where they stand, their logs, and what is not known of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ftproc.config import reading
from ftproc.config.keys import KEYS, Key
from ftproc.config.kinds import number, text, vector, words
from ftproc.config.recipe import Recipe
from ftproc.core.model.earth import Geodetic, seen_from
from ftproc.errors import UsageError, nearest
from ftproc.files import layout, remote
from ftproc.files.writing import atomic
from ftproc.records import FloatArray

MAKER = "--fuse --write-config LOG..."
FARTHEST_M = 500_000.0  # of a station from the origin
SMALLEST = number(0.0)
_WITHOUT_PARTS = (  # endings of files in which # names nothing
    *(".csv", ".txt", ".tsv", ".dat", ".asc", ".log", ".prn", ".gsi", ".parquet", ".feather"),
    *(".arrow", ".arrows", ".ipc", ".jsonl", ".ndjson", ".json", ".npy", ".npz"),
)
POSITION = "position"
_SIGMA = "1-sigma of what is not known beforehand, 0: known"

_DEGREES = {
    "lat_deg": Key("lat", number(-90, 90), 48.1, "geodetic latitude, north positive"),
    "lon_deg": Key("lon", number(-180, 360), 11.3, "longitude, east positive"),
    "height_m": Key("height", number(-1000, 100_000), 600.0, "above the ellipsoid"),
}
_METRES = {name: Key(name, number(), 0.0, "in the frame of the range") for name in ("east_m", "north_m", "up_m")}
ORIGIN: Mapping[str, Key] = _DEGREES
STATION: Mapping[str, Key] = {
    "log": Key("log", text, "radar.csv", "relative to this file"),
    "config": Key("config", text, "radar.toml", "the station file of the instrument"),
    "where": Key("where", text, "station=north", "which rows of the log are of this station"),
    "target": Key("target", text, "track=7", "which of several targets in the log"),
    **_DEGREES,
    **_METRES,
    "range_bias_sigma": Key("range", SMALLEST, 20.0, _SIGMA, quantity="range"),
    "azimuth_bias_sigma": Key("azimuth", SMALLEST, 1.0, _SIGMA, quantity="azimuth"),
    "elevation_bias_sigma": Key("elevation", SMALLEST, 1.0, _SIGMA, quantity="elevation"),
    "height_bias_sigma": Key("height", SMALLEST, 80.0, "of all its heights together, 1-sigma", quantity="range"),
    "level_sigma": Key("level", SMALLEST, 0.15, _SIGMA, quantity="elevation"),
    "clock_offset_sigma": Key("clock", SMALLEST, 0.0, _SIGMA, quantity="time"),
    "kind": Key("kind", words("tracker", POSITION), "tracker", "position: GNSS on board, ADS-B"),
    "sigma": Key("sigma", SMALLEST, 5.0, "of positions, 1-sigma; left out: estimated", quantity="range"),
    "lever_arm_m": Key("lever_arm_m", vector, [0, 0, 0], "of its antenna: ahead, right, up"),
}


@dataclass(frozen=True)
class Instrument:
    """A station of the range. log: its file. recipe: how that is read. options: as in a station file. place (3,) east,
    north, up at the origin m; axes (3, 3) its own east, north, up. prior (6,): 1-sigma m, rad, rad, tilts rad, clock s.
    config: its station file, or "". kind: tracker, or position, with sigma_m of its positions, 0 for one that is to be
    estimated, and lever_arm_m of the antenna, see `positions`. height_sigma_m: of what its heights are
    off by together, if stated. times: (n,) of the variance of its noise, by row, where its log states an accuracy.
    away_m: see `estimation.events.Seen`.
    """

    name: str
    log: str
    options: Mapping[str, Any]
    recipe: Recipe
    place: FloatArray
    axes: FloatArray
    prior: FloatArray
    site: Geodetic | None
    config: str = ""
    kind: str = "tracker"
    sigma_m: float = 0.0
    lever_arm_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    height_sigma_m: float | None = None
    times: FloatArray | None = None
    away_m: float = 0.0


@dataclass(frozen=True)
class Range:
    """A range file. origin: WGS-84, or None where the stations are in metres of a local frame."""

    path: str
    origin: Geodetic | None
    instruments: tuple[Instrument, ...]

    @property
    def inputs(self) -> list[str]:
        """All files that are read."""
        files = (name for each in self.instruments for name in (each.log, each.config))
        return [self.path, *filter(None, files)]


def load(path: str) -> Range:
    """A range file. Raises UsageError, naming file, station and key, for what is not understood."""
    content = reading.toml(_once(reading.read_text(path, "range file", MAKER), path), path)
    for section in content:
        if section not in ("origin", "station"):
            hint = nearest(section, ("origin", "station")) or "."
            raise UsageError(
                f'{path}: there is no section "{section}"{hint} A range file has [origin] and [station.NAME].'
            )
    origin = _origin(path, content.get("origin", {}))
    stations = content.get("station", {})
    if not isinstance(stations, Mapping) or not stations:
        raise UsageError(
            f"{path}: there is no station; write a section [station.NAME] for each, with its log and place."
        )
    found = tuple(_instrument(path, origin, name, keys) for name, keys in stations.items())
    _check_logs(path, found)
    return Range(path, origin, found)


def _check_logs(path: str, stations: Sequence[Instrument]) -> None:
    """Raise UsageError if two stations have the same log, under whatever names. Two groups of one file are two logs,
    and so are the rows of two conditions."""
    known: dict[object, list[tuple[str, Instrument]]] = {}
    for each in stations:
        file, part = _source(each.log)
        others = known.setdefault(file, [])
        for other_part, other in others:
            both, rows = part and other_part and part != other_part, (each.recipe.where, other.recipe.where)
            if not both and (rows[0] == rows[1] or not all(rows)):
                raise UsageError(
                    f"{path}: {other.name} and {each.name} have the same log, {each.log}; name the log of each."
                )
        others.append((part, each))


def _source(log: str) -> tuple[object, str]:
    """The identity of a log's file, and the part of it that # names, where its kind has parts."""
    path = remote.local(log)
    whole, mark, part = log.rpartition("#")
    if not mark or (path is not None and path.exists()):
        return atomic.identity(log), ""
    return atomic.identity(whole), "" if layout.ending(whole, _WITHOUT_PARTS) else part.strip("/")


def _once(content: str, path: str) -> str:
    """The text, if no station is in it twice, which TOML refuses in words of its own."""
    heads = [line.strip().replace(" ", "") for line in content.splitlines() if line.strip().startswith("[station.")]
    for head in heads:
        if heads.count(head) > 1:
            name = head.split("]")[0].removeprefix("[station.")
            raise UsageError(f"{path}: there are two stations of the name {name}; give each a name of its own.")
    return content


def _origin(path: str, keys: Any) -> Geodetic | None:
    if not isinstance(keys, Mapping):
        raise UsageError(f'{path}: "origin" is a section: write [origin], and its keys below it.')
    values = reading.values_of(f"{path}: [origin]", ORIGIN, keys)
    if not values:
        return None
    return _geodetic(f"{path}: [origin]", values)


def _geodetic(place: str, values: Mapping[str, Any]) -> Geodetic:
    missing = [name for name in _DEGREES if name not in values]
    if missing:
        raise UsageError(f"{place} needs all of lat_deg, lon_deg and height_m; {' and '.join(missing)} is missing.")
    return values["lat_deg"], values["lon_deg"], values["height_m"]


def _instrument(path: str, origin: Geodetic | None, name: str, keys: Any) -> Instrument:
    place = f"{path}: [station.{name}]"
    if not isinstance(keys, Mapping):
        raise UsageError(f'{path}: "{name}" is a station: write [station.{name}], and its keys below it.')
    if not name or name.startswith(".") or any(c in name for c in '/\\:*?"<>|') or not name.isprintable():
        raise UsageError(f'{path}: a station is called "{name}", and its edited log is a file of that name; rename it.')
    own, sections = _split(place, keys)
    values = reading.values_of(place, STATION, own)
    config = str(Path(path).parent / values["config"]) if "config" in values else ""
    options = _options(place, config, sections)
    options |= {
        key: value for key, value in (("where", values.get("where")), ("target", values.get("target"))) if value
    }
    if "log" not in values:
        raise UsageError(f'{place} names no log; write log = "{name}.csv".')
    log = str(Path(path).parent / values["log"])
    if "://" in values["log"]:
        log = values["log"]
    elif not Path(log.partition("#")[0]).exists():
        raise UsageError(f"{place}: there is no log {log}; correct log = ..., which is relative to {Path(path).name}.")
    site = options.get("site")
    kind = values.get("kind", "tracker")
    if kind == POSITION:
        _refuse_of_trackers(place, values)
        at, axes, site = np.zeros(3), np.eye(3), None
    else:
        at, axes, site = _stand(place, origin, values, site)
    level = values.get("level_sigma", 0.0)
    named = ("range_bias_sigma", "azimuth_bias_sigma", "elevation_bias_sigma")
    prior = [*(values.get(each, 0.0) for each in named), level, level, values.get("clock_offset_sigma", 0.0)]
    recipe = Recipe.of(options)
    arm = values.get("lever_arm_m", (0.0, 0.0, 0.0))
    own_kind = (kind, values.get("sigma", 0.0), arm, values.get("height_bias_sigma"))
    return Instrument(name, log, options, recipe, at, axes, np.array(prior), site, config, *own_kind)


def _refuse_of_trackers(place: str, values: Mapping[str, Any]) -> None:
    """Raise UsageError for what a station that is the target itself has not."""
    others = [name for name in values if name in (*_DEGREES, *_METRES) or name.endswith(("bias_sigma", "level_sigma"))]
    if others:
        raise UsageError(f'{place} has kind = "{POSITION}", so {others[0]} has no meaning there; leave it out.')


def _split(place: str, keys: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
    """The keys of the range file, and those of a station file by section: [station.radar.azimuth] from = "north", or
    azimuth_from = "north"."""
    own: dict[str, Any] = {}
    sections: dict[str, dict[str, Any]] = {}
    for key, value in keys.items():
        section, _, rest = key.partition("_")
        stem = key.rpartition("_")[0]
        if key in KEYS and isinstance(value, Mapping):
            sections.setdefault(key, {}).update(value)
        elif key in STATION or stem in STATION or section not in KEYS or not rest:
            own[key] = value
        elif rest in KEYS[section] or rest.rpartition("_")[0] in KEYS[section]:
            sections.setdefault(section, {})[rest] = value
        else:
            own[key] = value
    return own, sections


def _options(place: str, config: str, sections: Mapping[str, Any]) -> dict[str, Any]:
    """The options of the station's own file with those of the range file, which win."""
    kept = reading.load(config) if config else {}
    given = reading.options_of(sections, place) if sections else {}
    both = {**kept, **given}
    for name in ("units", "columns"):
        if name in both:
            both[name] = {**kept.get(name, {}), **given.get(name, {})}
    return both


def _stand(
    place: str, origin: Geodetic | None, values: Mapping[str, Any], site: Geodetic | None
) -> tuple[FloatArray, FloatArray, Geodetic | None]:
    """Where a station stands: place, axes, and its site on the earth."""
    earth, metres = [name for name in _DEGREES if name in values], [name for name in _METRES if name in values]
    if earth and metres:
        raise UsageError(
            f"{place} has {earth[0]} and {metres[0]}: a place is either on the earth or in metres of the range."
        )
    if metres:
        missing = [name for name in _METRES if name not in values]
        if missing:
            raise UsageError(f"{place} needs all of east_m, north_m and up_m; {' and '.join(missing)} is missing.")
        return np.array([values[name] for name in _METRES]), np.eye(3), None
    if earth:
        site = _geodetic(place, values)
    if site is None:
        kind = "lat_deg, lon_deg and height_m" if origin else "east_m, north_m and up_m"
        raise UsageError(f"{place} has no place; write {kind}.")
    if origin is None:
        raise UsageError(
            f"{place} stands on the earth, but [origin] has no lat_deg, lon_deg and height_m; write them there."
        )
    at, axes = seen_from(origin, site)
    if np.linalg.norm(at) > FARTHEST_M:
        raise UsageError(
            f"{place} is {np.linalg.norm(at) / 1000:.0f} km from the origin{_other_sign(origin, site)}; "
            "correct lat_deg and lon_deg (north and east are positive)."
        )
    return at, axes, site


def _other_sign(origin: Geodetic, site: Geodetic) -> str:
    """In words: the sign that would bring a station near the origin."""
    for name, other in (
        ("latitude", (-site[0], site[1], site[2])),
        ("longitude", (site[0], -site[1], site[2])),
        ("latitude and longitude", (-site[0], -site[1], site[2])),
    ):
        if np.linalg.norm(seen_from(origin, other)[0]) < FARTHEST_M / 2:
            return f", and would be near it with the other sign of its {name}"
    return ""
