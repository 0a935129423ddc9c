"""Trajectories on a map: KML, GeoJSON and CZML. They hold positions only and are not read back.

Heights in GeoJSON (RFC 7946) and CZML are above the WGS-84 ellipsoid, as in `height_m`. Heights in KML are above the
geoid (sea level): the geoid's height at the station is subtracted if known, else the file says so.
"""

from __future__ import annotations

import datetime as dt
import itertools
import json
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from ftproc.errors import InputError, UsageError, encodable
from ftproc.files import layout
from ftproc.files.layout import Target
from ftproc.records import FloatArray, Trajectory

_DEGREES, _METRES = 9, 4  # decimals: a tenth of a millimetre
_ASSUMED_EPOCH = "2000-01-01T00:00:00Z"  # of a log without a date; CZML needs one
_XML = '<?xml version="1.0" encoding="UTF-8"?>'
#: Viewers of GeoJSON and CZML put names into pages: they hold nothing that a page could take for an element or its end.
_NO_MARKUP = str.maketrans("<>&\"'", "\u2039\u203a+\u201d\u2019")
_NOT_XML = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ufffe\uffff\ud800-\udfff]")


class Track(NamedTuple):
    """The content of a map. position: (n, 3) longitude deg, latitude deg, height m, of samples with an estimate.
    pieces:
    its runs without gaps, of two samples or more. site: longitude, latitude, height of the station."""

    name: str
    about: str
    time_s: FloatArray
    position: FloatArray
    pieces: list[slice]
    site: tuple[float, float, float]
    geoid_m: float | None
    epoch: str


def check(target: Target, site: object) -> None:
    """Raise UsageError if `target` is a map and the station or the library for it is missing."""
    kind = layout.map_kind(target)
    if kind is None:
        return
    if site is None:
        raise UsageError(
            f"{target}: a {kind} map needs the station: give --site LAT,LON,HEIGHT, or [site] in the --config file."
        )
    if kind in _LIBRARIES:
        _library(kind)


def as_bytes(trajectory: Trajectory, kind: str) -> bytes:
    """The map as a file. Raises UsageError as `check`, InputError if no position was estimated."""
    return _WRITERS[kind](_track(trajectory, kind)).encode()


def _track(trajectory: Trajectory, kind: str) -> Track:
    metadata = trajectory.metadata
    settings = cast(Mapping[str, Any], metadata.get("settings", {}))
    extra, site = trajectory.extra, settings.get("site")
    check(f"out{kind}", site if extra is not None and "lat_deg" in extra.column_names else None)
    assert extra is not None
    assert site is not None
    columns = [np.asarray(extra.column(name)) for name in ("lon_deg", "lat_deg", "height_m")]
    position = np.column_stack([*(np.round(c, _DEGREES) for c in columns[:2]), np.round(columns[2], _METRES)])
    estimated = np.isfinite(position).all(1)
    if not estimated.any():
        raise InputError(f"{trajectory.name}: no position could be estimated, so there is nothing to draw on a map.")
    name = _NOT_XML.sub("?", encodable(Path(trajectory.name).name))
    how = "smoothed" if settings.get("smooth") else "filtered"
    return Track(
        name if kind == ".kml" else name.translate(_NO_MARKUP),
        f"{how} by {metadata['method']}, ftproc {metadata['version']}",
        trajectory.time_s[estimated], position[estimated], _pieces(position, estimated), (site[1], site[0], site[2]),
        settings.get("geoid_m"), str(metadata.get("epoch", "")),
    )  # fmt: skip


def _pieces(position: FloatArray, estimated: Any) -> list[slice]:
    """Runs without a gap, cut where the longitude jumps across 180 degrees."""
    row = np.flatnonzero(estimated)
    jump = np.abs(np.diff(position[row, 0])) > 180
    ends = np.flatnonzero((np.diff(row) > 1) | jump) + 1
    bounds = [0, *ends.tolist(), len(row)]
    return [slice(a, b) for a, b in itertools.pairwise(bounds) if b - a > 1]


def _geojson(track: Track) -> str:
    lines = [track.position[piece].tolist() for piece in track.pieces]
    times = [track.time_s[piece].tolist() for piece in track.pieces]
    station = {"type": "Point", "coordinates": list(track.site)}
    features = [
        _feature(station, {"name": "station"}),
        _feature(
            {"type": "MultiLineString", "coordinates": lines},
            {"name": track.name, "about": track.about, "epoch": track.epoch or None, "time_s": times},
        ),
    ]
    return json.dumps({"type": "FeatureCollection", "features": features}, ensure_ascii=False) + "\n"


def _feature(geometry: dict[str, Any], properties: dict[str, Any]) -> dict[str, Any]:
    return {"type": "Feature", "geometry": geometry, "properties": properties}


def _kml(track: Track) -> str:
    simplekml = _library(".kml")
    simplekml.Kml.resetidcounter()  # same trajectory, same bytes
    geoid = track.geoid_m or 0.0
    positions = np.round(track.position - (0.0, 0.0, geoid), _DEGREES)
    known = f"Heights are above the geoid, which is {geoid:g} m above the ellipsoid here."
    unknown = (
        "Heights are above the WGS-84 ellipsoid. A viewer counts them from the geoid (sea level), so they are off by "
        "its height at the station; give it as geoid_m under [site] of a station file."
    )
    about = f"{track.about}. {known if track.geoid_m is not None else unknown}"
    document = simplekml.Kml(name=track.name)
    longitude, latitude, height = track.site
    document.newpoint(name="station", coords=[(longitude, latitude, height - geoid)], altitudemode="absolute")
    lines = document.newmultigeometry(name=track.name, description=about)
    for piece in track.pieces:
        lines.newlinestring(coords=positions[piece].tolist(), altitudemode="absolute")
    if track.epoch:
        moving = document.newgxtrack(name=f"{track.name} in time", altitudemode="absolute")
        moving.newwhen(_instants(track))
        moving.newgxcoord(positions.tolist())
    # Without indents, for which simplekml would parse the document again.
    return f"{_XML}\n{document.kml(format=False)}\n"


def _instants(track: Track) -> list[str]:
    start = dt.datetime.fromisoformat(track.epoch)
    return [
        f"{(start + dt.timedelta(seconds=t)).isoformat(timespec='microseconds')[:26]}Z" for t in track.time_s.tolist()
    ]


def _czml(track: Track) -> str:
    czml3 = _library(".czml")
    properties = czml3.properties
    epoch, time_s = track.epoch or _ASSUMED_EPOCH, track.time_s - (0.0 if track.epoch else track.time_s[0])
    start = dt.datetime.fromisoformat(epoch)
    first, last = (start + dt.timedelta(seconds=float(t)) for t in (time_s[0], time_s[-1]))
    availability = czml3.types.TimeInterval(start=first, end=last)
    day = "" if track.epoch else " The log has no date: its first sample is placed at 2000-01-01."
    samples = np.column_stack([time_s, track.position]).ravel().tolist()
    colour = properties.Color(rgba=[255, 200, 0, 255])
    packets = [
        czml3.Packet(
            id="document", name=track.name, version="1.0",
            clock=czml3.types.IntervalValue(start=first, end=last, value=properties.Clock(currentTime=first)),
        ),
        czml3.Packet(
            id="station", name="station", point=properties.Point(pixelSize=8, color=colour),
            position=properties.Position(cartographicDegrees=list(track.site)),
        ),
        czml3.Packet(
            id="target", name=track.name, description=f"{track.about}.{day}", availability=availability,
            position=properties.Position(epoch=epoch, cartographicDegrees=samples),
            point=properties.Point(pixelSize=6, color=colour),
            path=properties.Path(show=True),
        ),
    ]  # fmt: skip
    return f"{czml3.Document(packets=packets).to_json()}\n"


def _library(kind: str) -> Any:
    import importlib

    name, requirement = _LIBRARIES[kind]
    try:
        if name == "czml3":
            importlib.import_module("czml3.properties")
        return importlib.import_module(name)
    except ImportError as error:
        raise UsageError(f'{kind} files need {name}, which is not installed: pip install "{requirement}".') from error


_LIBRARIES = {".kml": ("simplekml", "simplekml>=1.3.6"), ".czml": ("czml3", "czml3>=4")}
_WRITERS: Mapping[str, Callable[[Track], str]] = {".kml": _kml, ".geojson": _geojson, ".czml": _czml}
