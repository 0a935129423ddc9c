"""Animals that need what stands beside a reading: dates of times of day, headings of bearings, units in other columns,
lines above the table, and other targets in the same row."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import scipy.io

from tests.files.zoo.animals import DEG_A, DEG_E, FIRST_UTC, NORTH, SOD, F
from tests.files.zoo.flight import Animal, clock, dms, fixed, flight, lines, written

UTC = {"first_s": SOD, "utc": FIRST_UTC}
R, A, E = fixed(F.r, 3), fixed(DEG_A, 6), fixed(DEG_E, 6)
SECONDS = F.sod().tolist()
PLAIN = "time_s,range_m,azimuth_deg,elevation_deg"


def _log(name: str, content: str, file: str = "a.csv", **more: Any) -> Animal:
    return Animal(name, written(file, content), more.pop("options", NORTH), **{"first_s": 0, **more})


def _timed(name: str, head: str, column: Any, **more: Any) -> Animal:
    return _log(name, lines(f"{head},Range (m),Az (deg),El (deg)", column, R, A, E), **more)


def times_of_day() -> Iterator[Animal]:
    """Beside a date, or with frames."""
    moments = F.moments()
    for name, head, column, more in (
        ("MJD and seconds of the day", "MJD,SOD", [f"60461,{s:.3f}" for s in SECONDS], UTC),
        ("Julian day and its fraction", "JD,FracDay", [f"2460462,{s / 86400 - 0.5:.9f}" for s in SECONDS],
         {"first_s": SOD - 43200}),
        ("a date and ms of the day", "Date,ms of day", [f"2024-05-31,{round(s * 1e3)}" for s in SECONDS], UTC),
        ("a date and hours", "Date,UT (h)", [f"2024-05-31,{s / 3600:.9f}" for s in SECONDS], UTC),
        ("a date, hhmmss and ms", "DATE,HMS,MS",
         [f"{c[:15]},{int(c[16:19])}" for c in clock(moments, "%Y%m%d,%H%M%S.%f")], UTC),
        ("hhmmss with ms in one number", "Date,Time", [c[:18] for c in clock(moments, "%Y%m%d,%H%M%S%f")], UTC),
        ("a German date and hhmmss", "Date,HHMMSS", clock(moments, "%d.%m.%Y,%H%M%S.%f"), UTC),
        ("year, day of year and SS.SSS", "YYYY,DDD,HH,MM,SS.SSS", clock(moments, "%Y,%j,%H,%M,%S.%f"), UTC),
        ("two columns MM", "YYYY,MM,DD,hh,mm,ss", clock(moments, "%Y,%m,%d,%H,%M,%S.%f"), UTC),
        ("hundredths behind a colon", "Time (hh:mm:ss:cc)", [f"{c[:8]}:{c[9:11]}" for c in clock(moments)],
         {"first_s": SOD}),
        ("time codes, of which the name says the rate", "Timecode (30 fps)",
         [f"{c[:8]}:{round(float(c[8:]) * 30):02d}" for c in clock(moments)], {"first_s": SOD}),
        ("a date and time codes", "Date,Timecode (50 fps)",
         [f"{c[:19]}:{round(float(c[19:]) * 50):02d}" for c in clock(moments, "%Y-%m-%d,%H:%M:%S.%f")], UTC),
    ):  # fmt: skip
        yield _timed(name, head, column, **more)


def angles() -> Iterator[Animal]:
    """Azimuths that count from elsewhere, and parts of degrees."""
    heading = 40 + 0.5 * F.t
    relative = fixed((DEG_A - heading) % 360, 6)
    for name, head, added, bearing in (
        ("a relative bearing and a heading", "Relative Bearing (deg),Heading (deg)", heading, relative),
        ("a bearing marked R and a heading", "Bearing (deg R),Heading (deg T)", heading, relative),
        ("a magnetic bearing and the variation", "Bearing (deg M),Variation (deg)", np.full(len(F.t), -7.5),
         fixed((DEG_A + 7.5) % 360, 6)),
    ):  # fmt: skip
        text = lines(f"t,Range (m),{head},El (deg)", F.t, R, bearing, fixed(added, 6), E)
        yield _log(name, text, options={"azimuth_from": None})
    parts = lines("t,Slope Dist (m),AZ_D,AZ_M,AZ_S,ZD_D,ZD_M,ZD_S", F.t, R, dms(F.a, "{d},{m},{s:.2f}"),
                  dms(np.pi / 2 - F.e, "{d},{m},{s:.2f}"))  # fmt: skip
    yield _log("zenith distances in three columns", parts, options={"azimuth_from": "north"})
    minutes = [[f"{int(v)}.{v % 1 * 60:08.5f}".replace(".", "", 1).replace(".", "") for v in c] for c in (DEG_A, DEG_E)]
    packed = [[f"{cell[:-7]}.{cell[-7:]}" for cell in column] for column in minutes]
    yield _log("degrees with minutes behind the point", lines("t,Range (m),Az (DDD.MMm),El (DD.MMm)", F.t, R, *packed))
    apart = [[f"{int(v):03d}-{v % 1 * 60:08.5f}" for v in column] for column in (DEG_A, DEG_E)]
    yield _log("degrees and minutes apart", lines("t,Range(m),Bearing(deg-min),Elev(deg-min)", F.t, R, *apart))


def said() -> Iterator[Animal]:
    """Units beside the readings."""
    kyd, mil = fixed(F.r / 914.4, 6), [fixed(d * 6400 / 360, 5) for d in (DEG_A, DEG_E)]
    columns = (F.t, kyd, ["kyd"] * len(kyd), mil[0], ["mil"] * len(kyd), mil[1], ["mil"] * len(kyd))
    head = "Time (s),Range,Range Unit,Azimuth,Azimuth Unit,Elevation,Elevation Unit"
    yield _log("columns of units", lines(head, *columns))
    rows = zip(F.t.tolist(), kyd.tolist(), *(each.tolist() for each in mil), strict=True)
    nested = [{"t": t, "m": {"range": {"value": float(r), "unit": "kyd"}, "azimuth": {"value": float(a), "unit": "mil"},
                             "elevation": {"value": float(e), "unit": "mil"}}} for t, r, a, e in rows]  # fmt: skip
    yield _log("values and units in JSON", "\n".join(map(json.dumps, nested)), "a.jsonl")
    table = [
        {"time": t, "range": r, "azimuth": a, "elevation": e}
        for t, r, a, e in zip(F.t.tolist(), (F.r / 1852).tolist(), DEG_A.tolist(), DEG_E.tolist(), strict=True)
    ]
    units = {"time": "s", "range": "nmi", "azimuth": "deg", "elevation": "deg"}
    yield _log("units on top of JSON", json.dumps({"units": units, "data": table}), "a.json")
    feet = fixed(F.r / 0.3048, 3)
    head = "% All distances in feet, angles in mils, time in seconds\nt range az el"
    yield _log("a sentence of units", lines(head, F.t, feet, *mil, separator=" "), "a.txt")
    head = "# Units: s, ft, mil, mil\n# columns: time range azimuth elevation"
    yield _log("a list of units", lines(head, F.t, feet, *mil, separator=" "), "a.txt")
    miles = fixed(F.r / 1828.8, 6)
    yield _log("data miles", lines("! RNG IN DATA MILES (6000 FT), ANGLES IN MILS\nTIME RNG AZM ELV", F.t, miles, *mil,
                                   separator=" "), "a.txt")  # fmt: skip
    cells = [f"{r:.3f} m" if r < 6000 else f"{r / 1e3:.6f} km" for r in F.r.tolist()]
    yield _log("units that change from cell to cell", lines("t,Range,Az (deg),El (deg)", F.t, cells, A, E))
    german = lines("Zeit, s;Entfernung, m;Azimut, Grad;Elevation, Grad", F.t, R, A, E, separator=";")
    yield _log("units behind commas, and decimal commas", german.replace(".", ","))
    yield Animal("units of a structure of MATLAB", _structure, NORTH, 0)
    yield Animal("units in the metadata of fields", _fields, NORTH, 0)
    zenith = lines("# zenith angles in gon\nt,Range (m),Hz (gon),Zenith (gon)", F.t, R, fixed(DEG_A / 0.9, 6),
                   fixed(100 - DEG_E / 0.9, 6))  # fmt: skip
    yield _log("a comment that says what the names say", zenith)


def _structure(directory: Path) -> Path:
    units = {"t": "s", "range": "ft", "az": "mil", "el": "mil"}
    track = {"t": F.t, "range": F.r / 0.3048, "az": DEG_A * 6400 / 360, "el": DEG_E * 6400 / 360, "units": units}
    scipy.io.savemat(directory / "a.mat", {"trk": track})
    return directory / "a.mat"


def _fields(directory: Path) -> Path:
    columns = {"t": (F.t, "s"), "range": (F.r / 1852, "nmi"), "az": (DEG_A, "deg"), "el": (DEG_E, "deg")}
    schema = pa.schema([pa.field(name, pa.float64(), metadata={"unit": unit}) for name, (_, unit) in columns.items()])
    pq.write_table(pa.table([values for values, _ in columns.values()], schema), directory / "a.parquet")
    return directory / "a.parquet"


def asked() -> Iterator[Animal]:
    """What only the user knows."""
    off = fixed(F.r + 35, 3)
    head = "t,Range raw (m),Range corr (m),Az (deg),El (deg)"
    yield _log("a range and a corrected one", lines(head, F.t, off, R, A, E), asks="'range=Range corr (m)'",
               answer={"columns": {"range": "Range corr (m)"}})  # fmt: skip
    other = flight(1)
    columns = (F.t, fixed(other.r, 3), *(fixed(np.degrees(each), 6) for each in (other.a, other.e)), R, A, E)
    say = "range=T2_range_m,azimuth=T2_az_deg,elevation=T2_el_deg"
    yield _log("two targets side by side",
               lines("time_s,T1_range_m,T1_az_deg,T1_el_deg,T2_range_m,T2_az_deg,T2_el_deg", *columns),
               asks=say, answer={"columns": say})  # fmt: skip
    yield _log("ranges there and back", lines(f"# range: round-trip distance\n{PLAIN}", F.t, fixed(2 * F.r, 3), A, E),
               asks="--units 'range=0.5 m'",
               answer={"columns": "range=range_m", "units": {"range": "0.5 m"}})  # fmt: skip
    counts = [np.round(each / 360 * 2**24).astype(int) for each in (DEG_A, DEG_E)]
    yield _log("counts of encoders", lines("time_s,range_m,az_counts,el_counts", F.t, R, *counts))
    flights = fixed(2e6 * F.r / 299792458, 6)
    yield _log("times of flight", lines("time_s,tof_us,az_deg,el_deg", F.t, flights, A, E),
               asks="--units 'range=149.896229 m'",
               answer={"columns": "range=tof_us", "units": {"range": "149.896229 m"}})  # fmt: skip


def all_neighbours() -> Iterator[Animal]:
    for house in (times_of_day, angles, said, asked):
        yield from house()
