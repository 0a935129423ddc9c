"""The animals: texts, times, names and units, files, targets."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.feather
import pyarrow.parquet

from tests.files.zoo.flight import MIDNIGHT_START, START, Animal, clock, dms, flight, lines, written

F = flight()
NORTH = {"azimuth_from": "north"}
DEG_A, DEG_E = np.degrees(F.a), np.degrees(F.e)
PLAIN = lines("time_s,range_m,azimuth_rad,elevation_rad", F.t, F.r, F.a, F.e)
FIRST_UTC = "2024-05-31T12:34:56"
SOD = 45296.0
FLAT = (False, False, True)  # no elevation


def texts() -> Iterator[Animal]:
    """Text as it comes."""
    for mark in ("#", "%", "//", ";", "!"):
        head = f"{mark} Mission 12, radar 3\n{mark} recorded 2024-05-31\n\ntime_s,range_m,azimuth_rad,elevation_rad"
        yield Animal(f"comments {mark}", written("a.csv", lines(head, F.t, F.r, F.a, F.e)), first_s=0)
    head = "# Instrument: TRK-7\n# time range azimuth elevation"
    yield Animal("names in a comment", written("a.dat", lines(head, F.t, F.r, F.a, F.e, separator=" ")), first_s=0)
    head = "FLIGHT 1234 OF 31 MAY 2024\nSITE ALPHA, RADAR 2\n\nTIME,RANGE,AZ,EL\nsec,km,deg,deg"
    yield Animal("title and units", written("a.txt", lines(head, F.t, F.r / 1e3, DEG_A, DEG_E)), NORTH, 0)
    head = "Time;Slant Range;Azimuth;Elevation\n(s);(m);(gon);(gon)"
    text = lines(head, F.t, F.r, DEG_A / 0.9, DEG_E / 0.9, separator=";").replace(".", ",")
    yield Animal("decimal commas and units", written("a.csv", text), NORTH, 0)
    head = "Station,Alpha\nLat,48.1\nLon,11.3\nHeight,600\n\nTime (s),Range (m),Azimuth (deg),Elevation (deg)"
    yield Animal("keys and values above", written("a.csv", lines(head, F.t, F.r, DEG_A, DEG_E)), NORTH, 0)
    head = "  TIME    RANGE    AZIMUTH   ELEV\n  (SEC)   (YDS)    (DEG)     (DEG)\n  -----   -----    ------    -----"
    ruled = lines(head, F.t, F.r / 0.9144, DEG_A, DEG_E, separator="   ")
    yield Animal("a rule under the units", written("a.txt", ruled), NORTH, 0)
    columns = {"columns": "time=1,range=2,azimuth=3,elevation=4"}
    bare = lines("", F.t, F.r, F.a, F.e)
    yield Animal("no names", written("a.csv", bare), first_s=0, asks="--columns time=1,range=2", answer=columns)
    yield Animal("no names, blanks", written("a.txt", bare.replace(",", "  ")), columns, 0)
    wide = "".join(f"{t:10.2f}{r:12.2f}{a:12.6f}{e:12.6f}\n" for t, r, a, e in zip(F.t, F.r, F.a, F.e, strict=True))
    head = f"{'TIME':>10}{'RANGE (m)':>12}{'AZ (rad)':>12}{'EL (rad)':>12}\n"
    yield Animal("aligned columns", written("a.txt", head + wide), first_s=0, tolerance=0.1)
    tight = "".join(f"{t:06.1f}{r:09.2f}{a:09.6f}{e:09.6f}\n" for t, r, a, e in zip(F.t, F.r, F.a, F.e, strict=True))
    options = {"columns": "time=1,range=2,azimuth=3,elevation=4", "widths": (6, 9, 9, 9)}
    yield Animal("columns without blanks between", written("a.dat", tight), options, 0, tolerance=0.1)
    yield Animal("tabs", written("a.tsv", PLAIN.replace(",", "\t")), first_s=0)
    yield Animal("bars", written("a.txt", PLAIN.replace(",", "|")), first_s=0)
    for encoding in ("utf-16", "utf-16-le", "utf-32", "utf-8-sig"):
        yield Animal(encoding, written("a.csv", PLAIN.encode(encoding)), first_s=0)
    latin = lines("Zeit (s);Range (m);Bemerkung;Azimuth [°];Elevation [°];Höhe", F.t, F.r, F.t, DEG_A, DEG_E, F.t,
                  separator=";")  # fmt: skip
    yield Animal("Latin-1", written("a.csv", latin.encode("latin-1")), NORTH, 0)
    yield Animal("separators at the ends", written("a.csv", PLAIN.replace("\n", ",\n")), first_s=0)
    rows_only = PLAIN.split("\n", 1)[0] + "\n" + PLAIN.split("\n", 1)[1].replace("\n", ",\n")
    yield Animal("separators at the ends of rows", written("a.csv", rows_only), first_s=0)
    yield Animal("footer", written("a.csv", PLAIN + "END OF FILE\n# 120 records\nChecksum: 0x1F\n\x1a"), first_s=0)
    middle = PLAIN.split("\n")
    middle[40:40] = ["# camera on", "# note, with, commas, in it"]
    yield Animal("comments among the rows", written("a.csv", "\r\n".join(middle)), first_s=0)
    for word in ("-9999", "9999.0", "-99", "NaN", "null", "*", "-999.9", "---", "99999"):
        gone = np.arange(ROWS_GONE) * 9 + 5
        cells = [np.array([f"{v:.9g}" for v in column], dtype=object) for column in (F.t, F.r, DEG_A, DEG_E)]
        for column in cells[1:]:
            column[gone] = word
        text = lines("time_s,range_m,azimuth_deg,elevation_deg", *cells)
        yield Animal(f"missing is {word}", written("a.csv", text), NORTH, 0, missing=3 * ROWS_GONE)


ROWS_GONE = 8


def _timed(name: str, head: str, column: Any, **more: Any) -> Animal:
    return Animal(name, written("a.csv", lines(f"{head},R,A,E", column, F.r, F.a, F.e)), **more)


def times() -> Iterator[Animal]:
    """Clocks."""
    moments, late = F.moments(), F.moments(MIDNIGHT_START)
    stamp = clock(moments, "%Y-%m-%dT%H:%M:%S.%f")
    utc = {"first_s": SOD, "utc": FIRST_UTC}
    for head in ("UTC", "Timestamp", "DateTime", "Time (UTC)", "time_utc"):
        yield _timed(f"ISO, {head}", head, np.char.add(stamp, "Z"), **utc)
    ahead = clock(moments + np.timedelta64(2, "h"), "%Y-%m-%d %H:%M:%S.%f")
    yield _timed("offset +0200", "Timestamp", np.char.add(ahead, "+0200"), **utc)
    yield _timed("offset +02", "Timestamp", np.char.add(ahead, " +02"), **utc)
    behind = clock(moments - np.timedelta64(210, "m"), "%Y-%m-%dT%H:%M:%S.%f")
    yield _timed("offset -03:30", "Timestamp", np.char.add(behind, "-03:30"), **utc)
    yield _timed("stamps with UTC", "Time", np.char.add(clock(moments, "%Y-%m-%d %H:%M:%S.%f"), " UTC"), **utc)
    yield _timed("German stamps", "Zeit", clock(moments, "%d.%m.%Y %H:%M:%S.%f"), **utc)
    yield _timed("American stamps", "Time", clock(moments, "%m/%d/%Y %I:%M:%S.%f %p"), **utc)
    yield _timed("month by name", "Date Time", clock(moments, "%d-%b-%Y %H:%M:%S.%f"), **utc)
    leap = np.datetime64("2016-12-31T23:59:30", "us") + (F.t * 1e6).astype("timedelta64[us]")
    text = clock(leap, "%Y-%m-%dT%H:%M:%S.%fZ")
    text[60:62] = ["2016-12-31T23:59:60.000Z", "2016-12-31T23:59:60.500Z"]
    text[62:] = clock(leap[62:] - np.timedelta64(1, "s"), "%Y-%m-%dT%H:%M:%S.%fZ")
    yield _timed("leap second", "UTC", text, first_s=86370.0, utc="2016-12-31T23:59:30")
    yield _timed("time of day", "ToD", clock(moments), first_s=SOD)
    yield _timed("time of day over midnight", "UTC", clock(late), first_s=86370.0)
    yield _timed("seconds of day over midnight", "SOD", F.sod(MIDNIGHT_START), first_s=86370.0)
    yield _timed("time (sec)", "Time (sec)", F.t, first_s=0)
    yield _timed("hhmmss", "UTC (hhmmss.s)", clock(moments, "%H%M%S.%f"), first_s=SOD)
    yield _timed("IRIG", "IRIG", clock(moments, "%j:%H:%M:%S.%f"), first_s=SOD)
    yield _timed("IRIG over midnight", "IRIG-B", clock(late, "%j:%H:%M:%S.%f"), first_s=86370.0)
    yield _timed("year and day of year", "Time", clock(moments, "%Y-%j %H:%M:%S.%f"), **utc)
    yield _timed("day of year beside", "DOY,SOD", [f"152,{s!r}" for s in F.sod().tolist()], first_s=SOD)
    yield _timed("year, day of year, time", "Year,DOY,Time", np.char.add("2024,152,", clock(moments)), **utc)
    tow = F.sod() + 5 * 86400 + 18
    week = [f"2316,{s!r}" for s in tow.tolist()]
    yield _timed("GPS week and seconds", "GPS Week,GPS TOW (s)", week, first_s=tow[0], utc=FIRST_UTC)
    turned = (604790.0 + F.t) % 604800
    weeks = [f"{2316 + int(k > 19)},{s!r}" for k, s in enumerate(turned.tolist())]
    yield _timed("over the end of the GPS week", "Week,TOW", weeks, first_s=604790.0, utc="2024-06-01T23:59:32")
    itow = [f"2316,{s * 1e3!r}" for s in tow.tolist()]
    yield _timed("GPS week and milliseconds", "WN,iTOW [ms]", itow, first_s=tow[0], utc=FIRST_UTC)
    yield _timed("seconds of the week", "TOW", tow, first_s=tow[0])
    unix = moments.astype(np.int64)
    for power, name in ((0, "us"), (3, "ms"), (6, "s")):
        numbers = unix / 10**power if power == 6 else unix // 10**power
        cells = [str(v) for v in numbers.tolist()]
        yield _timed(f"epoch {name}", "Epoch", cells, first_s=unix[0] / 1e6, utc=FIRST_UTC)
    yield _timed("epoch ns", "timestamp", [f"{v}000" for v in unix.tolist()], first_s=unix[0] / 1e6, utc=FIRST_UTC)
    gps = unix / 1e6 - 315964800 + 18
    yield _timed("GPS seconds", "GPS time", [repr(v) for v in gps.tolist()], first_s=gps[0], utc=FIRST_UTC)
    both = [f"{d},{c}" for d, c in zip(clock(late, "%d/%m/%Y"), clock(late), strict=True)]
    yield _timed("date and time", "Date,Time", both, first_s=86370.0, utc="2024-05-31T23:59:30")
    constant = np.char.add("2024-05-31,", clock(late))
    yield _timed("date of the start", "Date,Time", constant, first_s=86370.0, utc="2024-05-31T23:59:30")
    parts = clock(moments, "%Y,%m,%d,%H,%M,%S.%f")
    yield _timed("calendar parts", "Year,Month,Day,Hour,Minute,Second", parts, **utc)
    days = unix / 86400e6
    yield _timed("Excel dates", "Time", [f"{v + 25569:.10f}" for v in days.tolist()], **utc)
    yield _timed("MJD", "MJD", [f"{v + 40587:.10f}" for v in days.tolist()], **utc)
    yield _timed("JD", "JD", [f"{v + 2440587.5:.9f}" for v in days.tolist()], **utc)
    spaced = [f"{d} {c}" for d, c in zip(clock(moments, "%Y-%m-%d"), clock(moments), strict=True)]
    text = lines("UTC RNG AZ EL", spaced, F.r, F.a, F.e, separator="  ")
    yield Animal("date and time apart by a blank", written("a.txt", text), **utc)


def _named(name: str, head: str, *columns: Any, **more: Any) -> Animal:
    return Animal(name, written("a.csv", lines(head, *columns)), NORTH, **more)


def names() -> Iterator[Animal]:
    """Names and units."""
    yield _named(
        "Azimuth [degree sign]", "Time,Slant Range [km],Azimuth [°],Elevation [°]", F.t, F.r / 1e3, DEG_A, DEG_E
    )
    yield _named("RNG_KM", "T,RNG_KM,AZ_DEG,EL_DEG", F.t, F.r / 1e3, DEG_A, DEG_E)
    yield _named("bare degrees", "Time,SR,AZ,ELEV", F.t, F.r, DEG_A, DEG_E)
    yield _named("RHO, THETA", "ToD,RHO (NM),THETA (deg),EL (deg)", F.t, F.r / 1852, DEG_A, DEG_E)
    yield _named("DIST, BRG", "t,DIST/yd,BRG/deg,EL/deg", F.t, F.r / 0.9144, DEG_A, DEG_E)
    yield _named("kiloyards and mils", "t,Range (kyd),Bearing (mils),Elev (mils)", F.t, F.r / 914.4, DEG_A / 360 * 6400,
                 DEG_E / 360 * 6400)  # fmt: skip
    yield _named("statute miles", "t,Slant range (statute miles),az (rad),el (rad)", F.t, F.r / 1609.344, F.a, F.e)
    yield _named("nautical miles", "t,range in nautical miles,azimuth in degrees,elevation in degrees", F.t, F.r / 1852,
                 DEG_A, DEG_E)  # fmt: skip
    yield _named("mils of 6000", "t,SR,AZ (mil),EL (mil)", F.t, F.r, DEG_A / 360 * 6000, DEG_E / 360 * 6000)
    yield _named("mils of 6300", "t,SR,AZ (mil),EL (mil)", F.t, F.r, DEG_A / 360 * 6300, DEG_E / 360 * 6300)
    gon = (DEG_A / 0.9, DEG_E / 0.9)
    yield _named("bare gon past a turn", "Time,SD,HZ,Altitude angle", F.t, F.r, *gon)
    zenith = 90 - DEG_E
    yield _named("bare V is a zenith angle", "Time,SD,Hz (deg),V (deg)", F.t, F.r, DEG_A, zenith)
    yield _named("ZA", "Time,SD (m),AZ (deg),ZA (deg)", F.t, F.r, DEG_A, zenith)
    for label, pattern in (("signs", "{d}°{m:02d}'{s:05.2f}\""), ("colons", "{d}:{m:02d}:{s:05.2f}"),
                           ("blanks", "{d} {m:02d} {s:05.2f}")):  # fmt: skip
        cells = (dms(F.a, pattern.replace('"', '""')), dms(F.e, pattern.replace('"', '""')))
        quoted = [[f'"{cell}"' for cell in column] for column in cells]
        yield _named(f"degrees with {label}", "t,range (m),Azimuth,Elevation", F.t, F.r, *quoted)
    digits = (dms(F.a, "{d:03d}{m:02d}{s:05.2f}"), dms(F.e, "{d:02d}{m:02d}{s:05.2f}"))
    yield _named("degrees as digits", "t,R,AZ (dddmmss.s),EL (ddmmss.s)", F.t, F.r, *digits)
    head = "Radar1_Time,Radar1_Range_m,Radar1_Az_deg,Radar1_El_deg"
    yield _named("the radar in every name", head, F.t, F.r, DEG_A, DEG_E)
    yield _named("German", "Zeit,Schrägentfernung,Azimut,Höhenwinkel", F.t, F.r, DEG_A, DEG_E)
    yield _named("two times", "Time (UTC),Time (s),Range,Az,El", clock(F.moments()), F.t, F.r, DEG_A, DEG_E)
    split = [dms(angle, "{d},{m},{s:.2f}") for angle in (F.a, F.e)]
    head = "t,R,Az deg,Az min,Az sec,El deg,El min,El sec"
    yield _named("degrees in three columns", head, F.t, F.r, *split)
    others = [np.full(len(F.t), 3.5) for _ in range(4)]
    head = "time_s,Range (m),Range Rate (m/s),SNR (dB),Azimuth (deg),Elevation (deg),Quality,Mode"
    yield _named("other columns", head, F.t, F.r, others[0], others[1], DEG_A, DEG_E, others[2], others[3])
    yield _named("camel case", "timeSec,slantRangeKm,azimuthDeg,elevationDeg", F.t, F.r / 1e3, DEG_A, DEG_E)
    yield _named("spelt out", "elapsed (seconds),slant range (feet),azimuth angle (degrees),elevation angle (degrees)",
                 F.t, F.r / 0.3048, DEG_A, DEG_E)  # fmt: skip
    with_units = [[f"{v:.4f} {u}" for v in column] for column, u in ((F.r / 1e3, "km"), (DEG_A, "deg"), (DEG_E, "deg"))]
    yield _named("units in the cells", "t,R,AZ,EL", F.t, *with_units, tolerance=0.1)


def _frame() -> pd.DataFrame:
    return pd.DataFrame({"time_s": F.t, "range_m": F.r, "azimuth_rad": F.a, "elevation_rad": F.e})


def _asterix(kind: str) -> str:
    records = []
    for k in range(len(F.t)):
        tod, rho, theta, trn = (round(float(v), 7) for v in (SOD + F.t[k], F.r[k] / 1852, DEG_A[k], 77))
        if kind == "items":
            body: dict[str, Any] = {"I140": {"ToD": {"val": tod, "meaning": "s"}},
                                    "I040": {"RHO": {"val": rho}, "THETA": {"val": theta}},
                                    "I161": {"Trn": {"val": int(trn)}}}  # fmt: skip
            records.append({"id": k, "cat": 48, "CAT048": body})
        else:
            records.append({"010": {"SAC": 1}, "040": {"RHO": rho, "THETA": theta}, "140": {"Time-of-Day": tod}})
    if kind == "items":
        return "".join(json.dumps(record) + "\n" for record in records)
    return json.dumps({"data_blocks": [{"category": 48, "content": {"records": records}}]})


def files() -> Iterator[Animal]:
    """Kinds of file."""
    frame, table, data = _frame(), pa.table(_frame()), PLAIN.encode()
    packers = {"gz": gzip.compress, "bz2": bz2.compress, "xz": lzma.compress,
               "zst": lambda raw: pa.compress(raw, "zstd", asbytes=True)}  # fmt: skip
    for ending, pack in packers.items():
        yield Animal(f".csv.{ending}", written(f"a.csv.{ending}", pack(data)), first_s=0)
    sink = io.BytesIO()
    with zipfile.ZipFile(sink, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("logs/a.csv", data)
    yield Animal("zip", written("a.zip", sink.getvalue()), first_s=0)
    rows = "".join(json.dumps(row) + "\n" for row in frame.to_dict("records"))
    yield Animal("JSON lines", written("a.jsonl", rows), first_s=0)
    yield Animal("JSON lines, packed", written("a.jsonl.xz", lzma.compress(rows.encode())), first_s=0)
    yield Animal("JSON array", written("a.json", frame.to_json(orient="records")), first_s=0)
    sink = io.BytesIO()
    with pa.ipc.new_stream(sink, table.schema) as stream:
        stream.write_table(table)
    yield Animal("Arrow stream", written("a.arrows", sink.getvalue()), first_s=0)
    sink = io.BytesIO()
    pa.feather.write_feather(table, sink)
    yield Animal("Arrow file", written("a.arrow", sink.getvalue()), first_s=0)
    sink = io.BytesIO()
    pa.parquet.write_table(table, sink)
    yield Animal("Parquet, packed", written("a.parquet.gz", gzip.compress(sink.getvalue())), first_s=0)
    yield Animal("ASTERIX items", written("a.jsonl", _asterix("items")), first_s=SOD, absent=FLAT)
    yield Animal("ASTERIX blocks", written("a.json", _asterix("blocks")), first_s=SOD, absent=FLAT)
    yield from _books(frame)
    yield from _arrays(frame)


def _books(frame: pd.DataFrame) -> Iterator[Animal]:
    def book(directory: Path, above: int = 0) -> Path:
        path = directory / "a.xlsx"
        with pd.ExcelWriter(path) as writer:
            pd.DataFrame({"note": ["made by hand"]}).to_excel(writer, sheet_name="About", index=False)
            frame.to_excel(writer, sheet_name="Log", index=False, startrow=above)
        return path

    def stamped(directory: Path) -> Path:
        path = directory / "a.xlsx"
        frame.assign(time_s=F.moments()).rename(columns={"time_s": "Date/Time"}).to_excel(path, index=False)
        return path

    yield Animal("Excel", book, first_s=0)
    yield Animal("Excel, rows above", lambda d: book(d, 3), first_s=0)
    yield Animal("Excel with dates", stamped, first_s=SOD, utc=FIRST_UTC)


def _arrays(frame: pd.DataFrame) -> Iterator[Animal]:
    def group(directory: Path) -> Path:
        import h5py

        path = directory / "a.h5"
        with h5py.File(path, "w") as file:
            for name in ("radar", "other"):
                for column in frame:
                    file[f"{name}/{column}"] = frame[column].to_numpy()
        return Path(f"{path}#radar")

    def matlab(directory: Path) -> Path:
        from scipy.io import savemat

        savemat(
            directory / "a.mat", {"t": F.t[:, None], "range_km": F.r / 1e3, "az_deg": DEG_A, "el_deg": DEG_E, "n": 3}
        )
        return directory / "a.mat"

    yield Animal("HDF5 group", group, first_s=0)
    yield Animal("Matlab", matlab, NORTH, 0)


def several() -> Iterator[Animal]:
    """Several targets in one file."""
    other = flight(1)
    order = np.argsort(np.r_[F.t, other.t + 0.1], kind="stable")
    columns = [np.r_[getattr(F, q), getattr(other, q) + (0.1 if q == "t" else 0)][order] for q in "trae"]
    track = np.r_[np.full(len(F.t), 7), np.full(len(F.t), 12)][order]
    text = lines("track,time_s,range_m,azimuth_rad,elevation_rad", track, *columns)
    one = {"target": "track=7"}
    yield Animal("two tracks", written("a.csv", text), first_s=0, asks="--target track=12", answer=one)
    text = lines("time_s,range_m,azimuth_rad,elevation_rad", *columns)
    low = {"where": "elevation_rad<0.3"}
    yield Animal("two tracks without a column", written("a.csv", text), first_s=0, asks="--where", answer=low)


def all_animals() -> Iterator[Animal]:
    for house in (texts, times, names, files, several):
        yield from house()


assert START < MIDNIGHT_START
