"""More animals: what stands below the rows, exports of other programs, clocks, names and other languages."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import numpy as np

from tests.files.zoo.animals import DEG_A, DEG_E, FIRST_UTC, NORTH, PLAIN, SOD, F
from tests.files.zoo.flight import Animal, clock, lines, written

STAMPS = np.char.add(clock(F.moments(), "%Y-%m-%dT%H:%M:%S.%f"), "Z")
UTC = {"first_s": SOD, "utc": FIRST_UTC}


def _log(name: str, head: str, *columns: Any, separator: str = ",", options: dict | None = None, **more: Any) -> Animal:
    """A text of these columns; of time, range and angles in rad where none are named."""
    text = lines(head, *(columns or (F.t, F.r, F.a, F.e)), separator=separator)
    return Animal(name, written("a.txt", text), options or {}, **{"first_s": 0, **more})


def _timed(name: str, head: str, column: Any, **more: Any) -> Animal:
    return _log(name, f"{head},R,A,E", column, F.r, F.a, F.e, **more)


def _degrees(name: str, head: str, **more: Any) -> Animal:
    return _log(name, head, F.t, F.r, DEG_A, DEG_E, options=NORTH, **more)


def footers() -> Iterator[Animal]:
    """Lines below the rows."""
    n = len(F.t)
    table = lines("time_s,range_m,azimuth_deg,elevation_deg", F.t, F.r, DEG_A, DEG_E)
    means = ",".join(f"{np.mean(v):.3f}" for v in (F.r, DEG_A, DEG_E))
    for name, tail in (
        ("a row of means", f"Mean,{means}\n"),
        ("statistics", f"Mean,{means}\nStd Dev,1.2,0.3,0.1\nMin,1,2,3\nMax:,9,8,7\nCount,{n},{n},{n}\n"),
        ("statistics after a blank line", f"\nAverage,{means}\n"),
        ("a number of rows in a word", f"Total rows: {n}\n"),
        ("a number of rows, padded", f"Total rows,{n},,\n"),
        ("a total", f"Total,{n}\n"),
        ("a number of rows first", f"{n} rows selected.\n"),
        ("a number of rows in brackets", f"({n} rows)\n"),
        ("a comment", "# end\n"),
        ("EOF", "EOF\n"),
        ("EOF, padded", "EOF,,,\n"),
        ("a rule and a sentence", "--------\nRecorded by TRK-7, 3 dropouts, 12 outliers\n"),
        ("stars", "*** END OF DATA ***\n"),
        ("quoted words", '"End of file","","",""\n'),
        ("the time of the end", "Recording stopped 2024-05-31 12:35:56\n"),
    ):
        yield Animal(f"below: {name}", written("a.csv", table + tail), NORTH, 0)
    flags = np.array(["Max" if k % 2 else "Min" for k in range(n)])
    head = "gain,time_s,range_m,azimuth_rad,elevation_rad"
    yield _log("words that sum up in every row", head, flags, F.t, F.r, F.a, F.e)


def exports() -> Iterator[Animal]:
    """Of spreadsheets, languages, databases and recorders."""
    number = np.arange(len(F.t))
    head = "time_s,range_m,azimuth_rad,elevation_rad"
    yield Animal("sep=;", written("a.csv", "sep=;\n" + PLAIN.replace(",", ";")), first_s=0)
    yield _log("thousands in quotes", head, F.t, [f'"{r:,.3f}"' for r in F.r], F.a, F.e)
    german = [f"{r:,.3f}".replace(",", "'").replace(".", ",").replace("'", ".") for r in F.r]
    rest = [[f"{v:.9f}".replace(".", ",") for v in column] for column in (F.t, F.a, F.e)]
    yield _log("thousands with points", head.replace(",", ";"), rest[0], german, *rest[1:], separator=";")
    yield _log("pandas with its index", f",{head}", number, F.t, F.r, F.a, F.e)
    yield _log("R", '"time" "range" "az" "el"', [f'"{k + 1}"' for k in number], F.t, F.r, F.a, F.e, separator=" ")
    yield _log("Fortran", "TIME RANGE AZ EL", F.t, [f"{r:.9E}".replace("E", "D") for r in F.r], F.a, F.e, separator=" ")
    above = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDate\t2024/05/31\n***End_of_Header***\t\n\n"
    head = f"{above}X_Value\tRange (m)\tAzimuth (deg)\tElevation (deg)\tComment"
    yield _log("LabVIEW", head, F.t, F.r, DEG_A, [f"{e:.7f}\t" for e in DEG_E], separator="\t", options=NORTH)
    above = "#group,false,false,true,true,false,false,false\n#datatype,string,long,string,dateTime:RFC3339,double"
    head = (
        f"{above},double,double\n#default,_result,,,,,,\n,result,table,source,_time,range_m,azimuth_rad,elevation_rad"
    )
    yield _log("InfluxDB", head, [f",,0,radar,{s}" for s in STAMPS], F.r, F.a, F.e, **UTC)
    ns = [f"{v}000" for v in F.moments().astype(np.int64).tolist()]
    head = "%time,field.header.seq,field.header.stamp,field.range,field.azimuth,field.elevation"
    yield _log("ROS", head, ns, number, ns, F.r, F.a, F.e, first_s=int(ns[0]) / 1e9, utc=FIRST_UTC)
    rows = [" | ".join(f"{v:>12.9g}" for v in row) for row in zip(F.t, F.r, F.a, F.e, strict=True)]
    names, rule = "      time_s |      range_m |  azimuth_rad | elevation_rad", "-+-".join(["-" * 13] * 4)
    text = "\n".join([names, rule, *rows, f"({len(rows)} rows)", "", ""])
    yield Animal("psql", written("a.txt", text), first_s=0)
    boxed, rule = [f"| {row} |" for row in rows], f"+-{rule}-+"
    text = "\n".join([rule, f"| {names} |", rule, *boxed, rule, f"{len(rows)} rows in set (0.00 sec)", ""])
    yield Animal("MySQL", written("a.txt", text), first_s=0)
    text = "\n".join([f"| {names} |", "|---|---:|:--:|---|", *boxed, ""])
    yield Animal("Markdown", written("a.md", text), first_s=0)
    page = lines("", F.t, F.r, DEG_A, DEG_E, separator="  ").splitlines()
    head = "1     RADAR 7 MISSION 12      PAGE {}\n\n  TIME(SEC)  RANGE(M)  AZ(DEG)  EL(DEG)\n\n"
    text = "".join(head.format(p + 1) + "\n".join(page[40 * p : 40 * p + 40]) + "\n" for p in range(3))
    yield Animal("a printout of three pages", written("a.txt", text), NORTH, 0)
    twice = PLAIN.splitlines()
    text = "\n".join([*twice[:60], "", twice[0], *twice[60:], ""])
    yield Animal("two files put together", written("a.csv", text), first_s=0)
    sentences = zip(clock(F.moments(), "%H%M%S.%f"), F.r, F.a, F.e, strict=True)
    text = "".join(f"$PTRK,{c},{r:.4f},{a:.8f},{e:.8f},*42\n" for c, r, a, e in sentences)
    said = {"asks": "--columns time=2,range=3", "answer": {"columns": "time=2,range=3,azimuth=4,elevation=5"}}
    yield Animal("sentences", written("a.txt", text), first_s=SOD, **said)
    columns = (STAMPS.tolist(), F.r.tolist(), F.a.tolist(), F.e.tolist())
    nested = [
        {"ts": s, "polar": {"range_m": r, "azimuth_rad": a, "elevation_rad": e}}
        for s, r, a, e in zip(*columns, strict=True)
    ]
    yield Animal("nested JSON", written("a.jsonl", "".join(json.dumps(row) + "\n" for row in nested)), **UTC)


def clocks() -> Iterator[Animal]:
    """Times."""
    moments = F.moments()
    delta = clock(np.datetime64("2024-01-01", "us") + (F.t * 1e6).astype("timedelta64[us]"))
    yield _timed("durations of pandas", "time", np.char.add("0 days ", delta))
    yield _timed("durations of Matlab", "Time", [f"{t:g} sec" for t in F.t])
    yield _timed("mission elapsed time", "MET", np.char.add("+", delta))
    yield _timed("before and after the launch", "time", [f"T{t - 10:+.2f}" for t in F.t], first_s=-10)
    yield _timed("milliseconds behind a colon", "Time", [c[:-3] for c in clock(moments, "%H:%M:%S:%f")], first_s=SOD)
    yield _timed("12h34m56s", "time", clock(moments, "%Hh%Mm%S.%fs"), first_s=SOD)
    yield _timed("day/clock", "IRIG", clock(moments, "%j/%H:%M:%S.%f"), first_s=SOD)
    apart = clock(moments, "%j %H:%M:%S.%f")
    yield _log("day and clock apart by a blank", "IRIG RNG AZ EL", apart, F.r, F.a, F.e, separator="  ", first_s=SOD)
    since_boot = [str(int(t * 1e6) + 53_000_000) for t in F.t]
    yield _timed("TimeUS", "TimeUS", since_boot, first_s=53)
    yield _timed("us since the start, unsaid", "timestamp", since_boot, first_s=53)
    yield _timed("ms since the start, unsaid", "time", [str(int(t * 1e3) + 5300) for t in F.t], first_s=5.3)
    yield _timed("a share of the day", "Time", [f"{v:.12f}" for v in F.sod() / 86400], first_s=SOD)


def names() -> Iterator[Animal]:
    """Names."""
    for name, head in (
        ("TRK_", "TRK_TIME_S,TRK_RNG_M,TRK_AZ_DEG,TRK_EL_DEG"),
        ("True Azimuth", "Time (s),Slant Range (m),True Azimuth (deg),Elevation (deg)"),
        ("Azimuth True", "Time (s),Slant Range (m),Azimuth True (deg),Elevation (deg)"),
        ("Az.Angle", "Time(s),SlantRange(m),Az.Angle(deg),El.Angle(deg)"),
        ("Target.", "Target.Time [s],Target.SlantRange [m],Target.Azimuth [deg],Target.Elevation [deg]"),
        ("Look", "Look Time (s),Look Range (m),Look Azimuth (deg),Look Elevation (deg)"),
        ("LOS", "Time (s),LOS Range (m),LOS Az (deg),LOS El (deg)"),
        ("to the target", "time_s,distance_to_target_m,bearing_to_target_deg,elevation_to_target_deg"),
    ):
        yield _degrees(name, head)
    yield _log("STK", '"Time (EpSec)","Azimuth (deg)","Elevation (deg)","Range (km)"', F.t, DEG_A, DEG_E, F.r / 1e3,
               options=NORTH)  # fmt: skip
    head = "time_s,range_m,range_rate_mps,azimuth_deg,azimuth_rate_dps,elevation_deg,elevation_rate_dps,altitude_m"
    yield _log("rates and heights", head, F.t, F.r, F.t, DEG_A, F.t, DEG_E, F.t, F.r, options=NORTH)
    head = "time_s,ground_range_m,slant_range_m,azimuth_mag_deg,azimuth_true_deg,elevation_deg"
    columns = (F.t, F.r * np.cos(F.e), F.r, DEG_A - 3, DEG_A, DEG_E)
    yield _log("magnetic and true", head, *columns, options=NORTH)
    head = "time_s,range_m,azimuth_deg,elevation_deg,range_est_m,azimuth_est_deg,elevation_est_deg"
    yield _log("estimates beside", head, F.t, F.r, DEG_A, DEG_E, F.r + 9, DEG_A + 1, DEG_E + 1, options=NORTH)
    one, other = "azimuth=theta,elevation=phi", "azimuth=phi,elevation=theta"
    yield _log("rho, theta, phi", "time,rho,theta,phi", asks=f"--columns {one}", answer={"columns": one})
    polar = np.pi / 2 - F.e
    yield _log("r, theta, phi of physics", "time,r,theta,phi", F.t, F.r, polar, F.a,
               asks=f"--columns {other}", answer={"columns": other, "elevation_from": "zenith"})  # fmt: skip
    head = "time_s,range_m,azimuth_mag_deg,elevation_deg"
    yield _degrees("magnetic alone", head, asks="--columns azimuth=azimuth_mag_deg",
                   answer={"columns": "azimuth=azimuth_mag_deg"})  # fmt: skip


def languages() -> Iterator[Animal]:
    """Names and units in other languages."""
    for name, head in (
        ("Chinese", "时间(s),斜距(m),方位角(°),俯仰角(°)"),
        ("Chinese units", "时间(秒),距离(米),方位(度),仰角(度)"),
        ("Japanese", "時刻(s),距離(m),方位角(°),仰角(°)"),
        ("Korean", "시간(s),거리(m),방위각(°),고각(°)"),
        ("Russian", "Время (с),Дальность (м),Азимут (град),Угол места (град)"),
        ("French", "Temps (s),Distance oblique (m),Azimut (deg),Site (deg)"),
        ("French, gisement", "Temps (s),Distance (m),Gisement (deg),Élévation (deg)"),
        ("Spanish", "Tiempo (s),Distancia (m),Acimut (deg),Elevación (deg)"),
        ("Italian", "Tempo (s),Distanza (m),Azimut (deg),Elevazione (deg)"),
        ("Portuguese", "Tempo (s),Distância (m),Azimute (deg),Elevação (deg)"),
        ("Polish", "Czas (s),Odległość (m),Azymut (deg),Elewacja (deg)"),
        ("Swedish", "Tid (s),Avstånd (m),Bäring (deg),Elevation (deg)"),
        ("Dutch", "Tijd (s),Afstand (m),Azimut (deg),Elevatie (deg)"),
        ("German, Grad are degrees", "Zeit (s),Schrägentfernung (m),Azimut (Grad),Elevation (Grad)"),
    ):
        yield _degrees(name, head)


def all_others() -> Iterator[Animal]:
    for house in (footers, exports, clocks, names, languages):
        yield from house()
