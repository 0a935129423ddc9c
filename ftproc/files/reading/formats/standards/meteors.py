"""FTPdetectinfo of meteor cameras (CAMS, RMS): a block for each meteor, a line for each of its frames.

The time is that in the name of the block's file plus the number of the frame over the frames per second; azimuths count
from north over east.
"""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from ftproc.errors import InputError
from ftproc.files.limits import Room
from ftproc.files.reading.formats.header import Stated, TableHeader
from ftproc.files.reading.formats.sparse import Sparse

_FILE = re.compile(r"FF\w*?_(\d{8})_(\d{6})_(\d{3})_\w+\.(?:fits|bin)")
_METEOR = re.compile(r"(\S+) (\d{4}) \d{4} (\d+\.\d+)( +[-+\d.]+){6}")
_LONGEST = 500  # characters of a line
_COLUMNS = "Frame# Col Row RA Dec Azim Elev"


def read(text: str, room: Room) -> TableHeader:
    """The directions of all meteors. Raises InputError for a file of other columns, and without meteors."""
    if _COLUMNS not in re.sub(" +", " ", text[:4000]):
        raise InputError(
            f"{room.name}: this FTPdetectinfo has no columns {_COLUMNS}; write it with azimuths (calibrated)."
        )
    columns = Sparse(room)
    start, station, meteor, rate = np.datetime64(0, "us"), "", "", 0.0
    number = 0
    for line in text.splitlines():
        words = line.split() if len(line) < _LONGEST else []
        if len(words) == 1 and (found := _FILE.fullmatch(words[0])):
            date, clock = found[1], found[2]
            start = np.datetime64(
                f"{date[:4]}-{date[4:6]}-{date[6:]}T{clock[:2]}:{clock[2:4]}:{clock[4:]}.{found[3]}000", "us"
            )
        elif head := _METEOR.fullmatch(line.strip()):
            number += 1
            station, meteor, rate = head[1], f"{number:04d}", float(head[3])
        elif rate and len(words) >= 7 and re.fullmatch(r"\d+\.\d+", words[0]):
            frame, azimuth, elevation = (float(words[k]) for k in (0, 5, 6))
            time = start + np.timedelta64(round(frame / rate * 1e6), "us")
            columns.add([("time", time), ("azimuth_deg", azimuth), ("elevation_deg", elevation), ("station", station),
                         ("meteor", meteor)])  # fmt: skip
        elif line.startswith("---"):
            rate = 0.0
    if not columns.rows:
        raise InputError(f"{room.name}: this FTPdetectinfo holds no meteors.")
    return replace(columns.header("FTPdetectinfo"), stated=Stated({}, "north", "meteor", "station"))
