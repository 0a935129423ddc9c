"""The text of a range file, for the user to fill in."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import count
from pathlib import Path

from ftproc.errors import InputError, UsageError
from ftproc.files.reading.formats import tables
from ftproc.files.reading.formats.standards import choosing


def template(logs: Sequence[str], azimuth_from: str | None) -> str:
    """The text of a range file for these logs, with places to fill in; a log of several stations is that of each."""
    if not logs:
        raise UsageError(
            "--fuse --write-config needs the logs of the stations: ftproc filter --fuse --write-config LOG..."
        )
    parts = [_HEAD, _ORIGIN]
    taken: list[str] = []
    for log in logs:
        for title, where, north in _stations(log):
            name = "".join(c if c.isalnum() or c in "-_" else "_" for c in title) or "station"
            name = next(each for k in count(1) if (each := name if k == 1 else f"{name}{k}") not in taken)
            taken.append(name)
            chosen = f"log = {json.dumps(log)}" + (f"\nwhere = {json.dumps(where)}" if where else "")
            axis = azimuth_from or ("north" if north else "x")
            parts.append(_STATION.format(name=name, log=chosen, azimuth=axis, clock=0 if len(taken) == 1 else 0.1))
    return "".join(parts)


def _stations(log: str) -> list[tuple[str, str, bool]]:
    """Name, condition on rows, and whether azimuths are known to be from north, of each station of a log."""
    try:
        header = tables.read_header(log)
        found = [
            (str(one.value), str(one), header.stated.azimuth_from == "north") for one in choosing.conditions(header)
        ]
        north = header.stated.azimuth_from == "north"
    except InputError:  # said when the range file is used
        found, north = [], False
    return found or [(Path(log).name.partition(".")[0], "", north)]


_HEAD = """\
# A range file of ftproc: ftproc filter --fuse THIS --smooth -o best.parquet. Logs are relative to this file.
# Keys of a station file may stand here too, such as azimuth_from = "north" or time_offset_s = 0.5; or in a file of
# its own: config = "radar.toml".

"""
_ORIGIN = """\
[origin]                        # of x east, y north, z up; leave its keys out for stations in metres
lat_deg = 48.0812               # WGS-84
lon_deg = 11.2803
height_m = 612.0                # above the ellipsoid
"""
_STATION = """
[station.{name}]
{log}
lat_deg = 48.0812               # or, with an empty [origin]: east_m, north_m, up_m
lon_deg = 11.2803
height_m = 612.0
azimuth_from = "{azimuth}"            # x: anticlockwise from east; north: clockwise
range_bias_sigma_m = 20         # 1-sigma of what is not known beforehand; 0: known
azimuth_bias_sigma_mrad = 1
elevation_bias_sigma_mrad = 1
level_sigma_mrad = 0.15         # tilt about east and about north
clock_offset_sigma_s = {clock}        # 0: this clock is the reference
"""
