"""Animals of other lands: loggers, sentences, encodings, total stations, clocks and units that nobody stated."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from tests.files.zoo.animals import DEG_A, DEG_E, FIRST_UTC, NORTH, SOD, F
from tests.files.zoo.flight import Animal, clock, fixed, lines, written

UTC = {"first_s": SOD, "utc": FIRST_UTC}
DAY = {"first_s": SOD}
UNIX = {"first_s": F.moments()[0].astype("datetime64[s]").astype(float), "utc": FIRST_UTC}
STAMPS = [moment[:-3] for moment in clock(F.moments(), "%Y-%m-%d %H:%M:%S.%f")]
R, A, E = fixed(F.r, 3), fixed(DEG_A, 6), fixed(DEG_E, 6)
N = len(F.t)
NUMBERS = [str(number) for number in F.moments().astype("datetime64[us]").astype(int).tolist()]


def _log(name: str, content: str | bytes, file: str = "a.log", **more: Any) -> Animal:
    return Animal(name, written(file, content), NORTH, **{"first_s": 0, **more})


def _each(pattern: str) -> str:
    """A line for each row: stamp {0}, time {1}, range {2}, azimuth {3} and elevation {4} in deg, time of day {5}."""
    rows = zip(STAMPS, F.t, R, A, E, strict=True)
    return "".join(pattern.format(stamp, f"{t:.2f}", r, a, e, stamp[11:]) + "\n" for stamp, t, r, a, e in rows)


def loggers() -> Iterator[Animal]:
    """Names and values in each line."""
    for name, pattern, more in (
        ("a logger", "{0} INFO R={2} AZ={3} EL={4}", UTC),
        ("Python's logging", "{0} - radar - INFO - range: {2} m, azimuth: {3} deg, elevation: {4} deg", UTC),
        ("logfmt", 'ts={1} level=info msg="track update" range_m={2} az_deg={3} el_deg={4}', {}),
        ("a stamp in brackets", "[{0}] trk: range={2}m az={3}deg el={4}deg snr=12dB", UTC),
        ("semicolons and equals", "T={1};R={2};A={3};E={4}", {}),
        ("colons and commas", "Time: {1}, Range: {2}, Az: {3}, El: {4}", {}),
        ("blanks round the equals", "time = {1}  range = {2}  az = {3}  el = {4}", {}),
        ("JSON in a logger", '{0} DEBUG {{"range": {2}, "az": {3}, "el": {4}}}', UTC),
        ("a dictionary of Python", "{{'time': {1}, 'range': {2}, 'az': {3}, 'el': {4}}}", {}),
        ("ROS prints", "time: {1}\nrange: {2}\nazimuth: {3}\nelevation: {4}\n---", {}),
        ("XML", '<p t="{1}" range="{2}" az="{3}" el="{4}"/>', {}),
        (
            "syslog",
            "May 31 {5} host trackd[311]: rng={2}m az={3}deg el={4}deg snr=13.2",
            DAY,
        ),
        ("a list of YAML", "- time: {1}\n  range: {2}\n  azimuth: {3}\n  elevation: {4}", {}),
    ):
        yield _log(name, _each(pattern), **more)
    unix = (
        f"track,site=A range_m={r},az_deg={a},el_deg={e},n=3i {at}000\n"
        for at, r, a, e in zip(NUMBERS, R, A, E, strict=True)
    )
    yield _log("points of a database", "".join(unix), **UNIX)
    among = _each("{0} DEBUG R={2} AZ={3} EL={4}").splitlines(keepends=True)
    among[40:40] = [f"{STAMPS[40]} INFO Tracker locked, mode=AUTO\n"]
    yield _log("a logger with other lines", "".join(among), **UTC)


def markup() -> Iterator[Animal]:
    """XML with an element for each reading, or for each column."""
    values = (
        "<range unit='m'>{2}</range>",
        "<azimuth unit='deg'>{3}</azimuth>",
        "<elevation unit='deg'>{4}</elevation>",
    )
    elements = _each("<plot><time unit='s'>{1}</time>" + "".join(values) + "</plot>")
    head = '<?xml version="1.0"?>\n<log xmlns="urn:range"><head><site lat="48.1" lon="11.2"/></head>\n'
    yield _log("elements", f"{head}{elements}</log>", "a.xml")
    yield _log("elements, broken off", f"{head}{elements}<plot><time unit='s'>", "a.xml")
    inner = _each("<m><at>{0}</at><polar><range_m>{2}</range_m><az_deg>{3}</az_deg><el_deg>{4}</el_deg></polar></m>")
    yield _log("elements in elements", f"<log>{inner.replace('at>', 'timestamp>')}</log>", "a.xml", **UTC)
    columns = zip(
        ("time", "range", "azimuth", "elevation"), ("s", "m", "deg", "deg"), (map(str, F.t), R, A, E), strict=True
    )
    lists = "".join(f'<{name} unit="{unit}">{" ".join(cells)}</{name}>' for name, unit, cells in columns)
    yield _log("an element for each column", f"<log>{lists}</log>", "a.xml")


def names() -> Iterator[Animal]:
    """Of times with words beside, and of angles that leave open which is which."""
    unix = [f"{number / 1e6:.3f}" for number in map(int, NUMBERS)]
    for head, times, more in (
        ("time_unix_s", unix, UNIX),
        ("log_time_us", NUMBERS, UNIX),
        ("time since launch [s]", map(str, F.t), {}),
        ("time_of_day_s", fixed(F.sod(), 3), DAY),
    ):
        yield _log(f"a time named {head}", lines(f"{head},range_m,az_deg,el_deg", times, R, A, E), **more)
    rad = lines("t,rho,psi,theta", F.t, R, fixed(F.a, 7), fixed(F.e, 7))
    say = {"columns": "azimuth=psi,elevation=theta"}
    yield _log("angles named psi and theta", rad, asks="--columns azimuth=psi,elevation=theta", answer=say)
    other = lines("t,range,ha,inc2", F.t, R, A, E)
    yield _log("an angle with a name that nobody knows", other, asks="--columns elevation=inc2",
               answer={"columns": "elevation=inc2"})  # fmt: skip


def sentences() -> Iterator[Animal]:
    """Of NMEA and of total stations."""
    stamps = clock(F.moments(), "%H%M%S.%f")
    ours = "".join(f"$RDTRK,{c},{r},M,{a},T,{e},D*42\n" for c, r, a, e in zip(stamps, R, A, E, strict=True))
    say = "time=2,range=3,azimuth=5,elevation=7"
    yield _log("sentences with letters", ours, first_s=SOD, asks=f"--columns {say}", answer={"columns": say})
    blocks = "".join(_gsi(k) for k in range(N))
    yield _log("GSI of 8 digits", blocks, "a.gsi", **UTC)


def _gsi(k: int) -> str:
    gon = (DEG_A[k] / 0.9, (90 - DEG_E[k]) / 0.9)
    moment = F.moments()[k].item()
    stamp = (f"{moment:%y%S}{moment.microsecond // 1000:03d}0", f"{moment:%m%d%H%M}")
    words = (f"11{k + 1:04d}+{k + 1:08d}", f"18....+{stamp[0]}", f"19....+{stamp[1]}",
             f"21.322+{round(gon[0] * 1e5):08d}", f"22.322+{round(gon[1] * 1e5):08d}",
             f"31..00+{round(F.r[k] * 1e3):08d}")  # fmt: skip
    return " ".join(words) + " \n"


def encodings() -> Iterator[Animal]:
    """National ones, of which nothing in the file tells."""
    body = lines("", F.t, R, A, E)
    for head, names in (
        ("时间,斜距,方位角,俯仰角", ("gbk", "gb18030", "utf-16")),
        ("時間,斜距,方位角,仰角", ("big5",)),
        ("時刻(秒),距離(m),方位角(度),仰角(度)", ("shift_jis", "euc_jp")),
        ("시간(s),거리(m),방위각(도),고각(도)", ("euc-kr",)),
        ("ВРЕМЯ,ДАЛЬНОСТЬ,АЗИМУТ,УГОЛ МЕСТА", ("cp1251", "koi8-r", "cp866", "iso8859-5", "utf-8")),
        ("Czas,Odległość,Azymut,Elewacja", ("cp1250", "iso8859-2")),
        ("Zaman,Eğik Mesafe,Azimut,Yükseliş", ("cp1254",)),
        ("t,Range (m),Az (°),El (°)", ("mac_roman", "cp437")),
    ):
        for name in names:
            yield _log(f"{head} in {name}", f"{head}\n{body}".encode(name), "a.csv")
    wide = "时间（秒）\t斜距（米）\t方位角（度）\t俯仰角（度）\n" + body.replace(",", "\t")
    yield _log("wide brackets", wide.encode("gbk"), "a.txt")


def _timed(name: str, head: str, column: Any, **more: Any) -> Animal:
    return _log(name, lines(f"{head},Range (m),Az (deg),El (deg)", column, R, A, E), "a.csv", **more)


def clocks() -> Iterator[Animal]:
    """Times."""
    moments, unix = F.moments(), F.moments().astype(np.int64)
    newer = F.moments(np.datetime64("2023-12-31T23:59:40", "us"))
    noon = F.moments(np.datetime64("2024-05-31T12:59:40", "us"))
    for name, head, column, more in (
        ("day of the year over the new year", "IRIG", clock(newer, "%j:%H:%M:%S.%f"), {"first_s": 86380}),
        ("twelve hours without am and pm", "Time", clock(noon, "%I:%M:%S.%f"), {"first_s": 46780}),
        ("minutes and seconds, of Excel", "Time", clock(noon, "%M:%S.%f"), {"first_s": 3580}),
        ("yyyymmddhhmmss", "UTC", clock(moments, "%Y%m%d%H%M%S.%f"), UTC),
        ("Oracle", "TS", clock(moments, "%d-%b-%y %I.%M.%S.%f %p"), UTC),
        ("a zone by its letters", "Time", clock(moments + np.timedelta64(2, "h"), "%Y-%m-%d %H:%M:%S.%f CEST"), UTC),
        ("GPST", "GPST", clock(moments + np.timedelta64(18, "s"), "%Y/%m/%d %H:%M:%S.%f"),
         {"first_s": SOD + 18, "utc": FIRST_UTC}),
        ("ticks of .NET", "Ticks", [str(v * 10 + 621355968000000000) for v in unix.tolist()],
         {"first_s": unix[0] / 1e6, "utc": FIRST_UTC}),
        ("LabVIEW, since 1904", "Timestamp", [f"{v / 1e6 + 2082844800:.3f}" for v in unix.tolist()],
         {"first_s": unix[0] / 1e6, "utc": FIRST_UTC}),
        ("datenum", "datenum", [f"{v / 86400e6 + 719529:.9f}" for v in unix.tolist()], UTC),
        ("seconds and nanoseconds of ROS", "header.stamp.sec,header.stamp.nanosec",
         [f"{v // 10**6},{v % 10**6 * 1000}" for v in unix.tolist()], {"first_s": unix[0] / 1e6, "utc": FIRST_UTC}),
        ("milliseconds beside the clock", "Time,ms",
         [f"{c[:8]},{int(c[9:12])}" for c in clock(moments)], {"first_s": SOD}),
        ("whole seconds, two rows in each", "Time", clock(moments, "%H:%M:%S"), {"first_s": SOD}),
        ("year, month, day and seconds", "YYYY,MM,DD,SOD", [f"2024,05,31,{s!r}" for s in F.sod().tolist()], UTC),
        ("parts with UTC", "UTC_HH,UTC_MM,UTC_SS", clock(moments, "%H,%M,%S.%f"), {"first_s": SOD}),
    ):  # fmt: skip
        yield _timed(name, head, column, **more)


def units() -> Iterator[Animal]:
    """Units that nobody stated, and rare ones."""
    yield Animal("range in km, unsaid", written("a.csv", lines("time_s,range,az,el", F.t, fixed(F.r / 1e3, 6), A, E)),
                 NORTH, 0, asks="--units range=km", answer={"units": "range=km"})  # fmt: skip
    for name, factor in (("urad", np.pi / 180 * 1e6), ("cdeg", 100), ("rev", 1 / 360), ("Strich", 6400 / 360)):
        text = lines(f"t,Range (m),Azimuth [{name}],Elevation [{name}]", F.t, R, fixed(DEG_A * factor, 9),
                     fixed(DEG_E * factor, 9))  # fmt: skip
        yield _log(f"angles in {name}", text, "a.csv")
    minutes = [[f"{int(v)}°{v % 1 * 60:.5f}'" for v in column] for column in (DEG_A, DEG_E)]
    yield _log("degrees and decimal minutes", lines("t,Range (m),Az,El", F.t, R, *minutes), "a.csv")
    below = lines("t,Range (m),Az (deg),Depression (deg)", F.t, R, A, fixed(-DEG_E, 6))
    yield _log("angles of depression", below, "a.csv")


def missing() -> Iterator[Animal]:
    """Words and numbers for no reading."""
    gone = np.arange(8) * 9 + 5
    for word in (
        "0",
        "-1",
        "65535",
        "9.99E+99",
        "#N/A",
        "#DIV/0!",
        "--.--",
        "********",
        "////",
        "inf",
        "нет",
        "no lock",
    ):
        cells = [np.array(column, dtype=object) for column in (R, A, E)]
        for column in cells:
            column[gone] = word
        text = lines("time_s,range_m,azimuth_deg,elevation_deg", F.t, *cells)
        yield _log(f"no reading is {word}", text, "a.csv", missing=24)


def tables() -> Iterator[Animal]:
    """Tables in files."""
    stacked = "   TIME     SLANT    AZIMUTH  ELEVATION\n            RANGE     ANGLE     ANGLE\n"
    rows = "".join(f"{t:8.2f}{float(r):11.3f}{float(a):11.6f}{float(e):11.6f}\n"
                   for t, r, a, e in zip(F.t, R, A, E, strict=True))  # fmt: skip
    yield _log("names in two lines", stacked + "   (SEC)     (M)      (DEG)     (DEG)\n" + rows, "a.txt")
    body = lines("", F.t, R, A, E)
    yield _log(
        "groups of columns", f"Time,Target,Target,Target\n,Range,Azimuth,Elevation\ns,m,deg,deg\n{body}", "a.csv"
    )
    head = "".join(f"Column {k}: {n}\n" for k, n in enumerate(("time (s)", "range (m)", "az (deg)", "el (deg)"), 1))
    yield _log("columns explained above", f"{head}\n{body}".replace(",", " "), "a.txt")
    among = body.splitlines(keepends=True)
    among[50:50] = ["*** LOST TRACK ***\n", "Reacquired\n"]
    yield _log("words among the rows", "t,Range (m),Az (deg),El (deg)\n" + "".join(among), "a.csv")
    among[50:52] = ["EVENT,release,1,\n"]
    yield _log("events among the rows", "t,Range (m),Az (deg),El (deg)\n" + "".join(among), "a.csv",
               asks="--where 't!=EVENT'", answer={"where": "t!=EVENT"})  # fmt: skip
    stamps = clock(F.moments(), "%Y-%m-%d %H:%M:%S.%f")
    yield _log("an index without a name", lines(",range_m,az_deg,el_deg", stamps, R, A, E), "a.csv", **UTC)
    data = {"columns": ["time_s", "range_m", "az_deg", "el_deg"], "index": list(range(N)),
            "data": [[float(v) for v in row] for row in zip(F.t, R, A, E, strict=True)]}  # fmt: skip
    yield _log("JSON of pandas, split", json.dumps(data), "a.json")
    yield Animal("a matrix of HDF5", _matrix, NORTH, 0)
    yield Animal("Excel in German, its summary first", _german, NORTH, 0)


def _matrix(directory: Path) -> Path:
    import h5py

    with h5py.File(directory / "a.h5", "w") as file:
        matrix = file.create_dataset("data", data=np.column_stack([F.t, F.r, DEG_A, DEG_E]))
        matrix.attrs["columns"] = ["time_s", "range_m", "az_deg", "el_deg"]
    return directory / "a.h5"


def _german(directory: Path) -> Path:
    import openpyxl

    book = openpyxl.Workbook()
    for row in (("Run", "Mean", "Max"), *((k, 4000 + k, 5000 + k) for k in range(12))):
        book.active.append(row)
    sheet = book.create_sheet("TSPI")
    sheet.append(("Zeit (s)", "Entfernung (m)", "Azimut (°)", "Elevation (°)"))
    for row in zip(map(str, F.t.tolist()), R, A, E, strict=True):
        sheet.append([str(cell).replace(".", ",") for cell in row])
    sheet.append(("Mittelwert", "4000", "140", "17"))
    book.save(directory / "a.xlsx")
    return directory / "a.xlsx"


def all_strangers() -> Iterator[Animal]:
    for house in (loggers, markup, names, sentences, encodings, clocks, units, missing, tables):
        yield from house()
