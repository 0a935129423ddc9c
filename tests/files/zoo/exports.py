"""Animals as programs and other languages write them: printed arrays, ruled listings, structures, comments in odd
places, columns whose names say nothing."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tests.files.zoo.animals import DEG_A, DEG_E, FIRST_UTC, NORTH, PLAIN, SOD, F
from tests.files.zoo.flight import Animal, clock, lines, written

GON_A, GON_E = DEG_A / 0.9, DEG_E / 0.9
MIL_A, MIL_E = DEG_A * 6000 / 360, DEG_E * 6000 / 360
STAMPS = np.char.add(clock(F.moments(), "%Y-%m-%dT%H:%M:%S.%f"), "Z")
DMS = {"tolerance": 1.0, "first_s": SOD, "utc": FIRST_UTC}


def _named(head: str, *columns: Any, encoding: str = "utf-8", **more: Any) -> Animal:
    text = lines(head, *columns, separator=";").replace(".", ",").encode(encoding)
    return Animal(head, written("a.csv", text), NORTH, 0, **more)


def languages() -> Iterator[Animal]:
    """Names and units in the languages of other ranges."""
    yield _named("Czas [s];Odległość skośna [m];Azymut [tys];Kąt podniesienia [tys]", F.t, F.r, MIL_A, MIL_E,
                 encoding="cp1250")  # fmt: skip
    yield _named("Zaman (s);Eğik mesafe (m);Yön açısı (derece);Yükseliş açısı (derece)", F.t, F.r, DEG_A, DEG_E,
                 encoding="cp1254")  # fmt: skip
    yield _named("Tempo [s];Distanza obliqua [m];Azimut [°];Sito [°]", F.t, F.r, DEG_A, DEG_E)
    yield _named("Instant (s);Distance oblique (km);Gisement (grades);Site (grades)", F.t, F.r / 1e3, GON_A, GON_E)
    yield _named("Tiempo (s);Distancia inclinada (m);Acimut (grados);Ángulo de elevación (grados)", F.t, F.r, DEG_A,
                 DEG_E, encoding="latin-1")  # fmt: skip
    yield _named("Время, с;Дальность наклонная, км;Азимут, град;Угол места, град", F.t, F.r / 1e3, DEG_A, DEG_E,
                 encoding="cp1251")  # fmt: skip
    yield _named("Zeit (s);Distanz (m);Azimut (A‰);Lagewinkel (A‰)", F.t, F.r, DEG_A * 6400 / 360, DEG_E * 6400 / 360)
    yield _named("Zeit (s);Sd [m];Hz [g];V (Zenit) [g]", F.t, F.r, GON_A, 100 - GON_E)


def comments() -> Iterator[Animal]:
    """Comments between the names and the rows, and rules of several kinds."""
    for mark, separator in (("#", ","), ("%", ";"), ("!", "\t")):
        head = f"t_s,range_m,az_deg,el_deg\n{mark} sensor 2, tape 17".replace(",", separator)
        text = lines(head, F.t, F.r, DEG_A, DEG_E, separator=separator)
        yield Animal(f"a comment {mark} below the names", written("a.csv", text), NORTH, 0)
    head = "| t (s) | R (m) | Az (°) | El (°) |\n|------:|------:|-------:|:------|"
    text = lines("", F.t, F.r, DEG_A, DEG_E, separator=" | ").splitlines()
    boxed = "\n".join([head, *(f"| {row} |" for row in text if row.strip()), ""])
    yield Animal("Markdown with its rule aligned", written("a.md", boxed), NORTH, 0)
    stamps = [stamp.lstrip("0") for stamp in clock(F.moments(), "%d May %Y %H:%M:%S.%f")]
    rows = zip(stamps, DEG_A.tolist(), DEG_E.tolist(), (F.r / 1e3).tolist(), strict=True)
    report = "".join(f"{when:>27}    {a:15.8f}    {e:15.8f}    {r:13.6f}\n" for when, a, e, r in rows)
    head = "Facility-1-To-Aircraft-7: AER\n\n"
    head += f"{'Time (UTCG)':>20}{'Azimuth (deg)':>26}{'Elevation (deg)':>19}{'Range (km)':>16}\n"
    head += f"{'-' * 27}    {'-' * 15}    {'-' * 15}    {'-' * 13}\n"
    yield Animal("a report of STK", written("a.txt", head + report), NORTH, SOD, utc=FIRST_UTC)


def printed() -> Iterator[Animal]:
    """What programs print."""
    rows = zip(F.t.tolist(), F.r.tolist(), F.a.tolist(), F.e.tolist(), strict=True)
    text = "[" + ",\n ".join(str(list(row)) for row in rows) + ",\n]\n"
    columns = {"columns": "time=1,range=2,azimuth=3,elevation=4"}
    yield Animal("a list of lists", written("a.txt", text), asks=columns["columns"], answer=columns, first_s=0)
    seconds = [np.degrees(each) * 3600 for each in (F.a, F.e)]
    cells = [
        [f"{s // 3600:.0f}°{s % 3600 // 60:02.0f}'{s % 60:05.2f}\"" for s in np.round(each, 2)] for each in seconds
    ]
    pairs = zip(STAMPS.tolist(), *cells, F.r.tolist(), strict=True)
    text = "".join(f"{when} AZ={a} EL={e} R={r:.3f}m\n" for when, a, e, r in pairs)
    yield Animal("degrees with minutes and seconds in pairs", written("a.log", text), NORTH, **DMS)
    rows = lines("", F.t, F.r, F.a, F.e, separator="  ").splitlines()
    rows[50] = f"{rows[50].split()[0]}  ---  ---  ---"
    yield Animal("dashes without names", written("a.txt", "\n".join([*rows, ""])), columns, 0, missing=3)
    item = "I048/140,I048/040-RHO,I048/040-THETA,I048/161"
    tracks = np.full(len(F.t), 1044)
    text = lines(f"{item},I048/090", F.t + 36000, F.r / 1852, DEG_A, tracks, np.full(len(F.t), 310.25))
    yield Animal("items of category 048", written("a.csv", text), first_s=36000, absent=(False, False, True))


def structures() -> Iterator[Animal]:
    """Values inside each other, and files beside each other."""
    data = {"time": (F.t * 1e3).tolist(), "range": (F.r / 1e3).tolist(), "az": DEG_A.tolist(), "el": DEG_E.tolist()}
    document = {"units": {"time": "ms", "range": "km", "az": "deg", "el": "deg"}, "data": data}
    yield Animal("columns beside their units", written("a.json", json.dumps(document)), NORTH, 0)
    yield Animal("a structure in Parquet", _structured, NORTH, 0)
    yield Animal("an archive with a note", _archive, NORTH, 0)
    yield Animal("a file of an archive", _member, NORTH, 0)


def _structured(directory: Path) -> Path:
    polar = [{"range_m": r, "az_deg": a, "el_deg": e} for r, a, e in zip(F.r, DEG_A, DEG_E, strict=True)]
    pq.write_table(pa.table({"t_s": F.t, "polar": polar}), directory / "a.parquet")
    return directory / "a.parquet"


def _archive(directory: Path) -> Path:
    with zipfile.ZipFile(directory / "a.zip", "w") as archive:
        archive.writestr("README.txt", "Recorded on the range.\n")
        archive.writestr("run/track.csv", PLAIN)
    return directory / "a.zip"


def _member(directory: Path) -> Path:
    with zipfile.ZipFile(directory / "a.zip", "w") as archive:
        archive.writestr("other.csv", "time_s,range_m\n0,1\n")
        archive.writestr("track.csv", PLAIN)
    return directory / "a.zip#track.csv"


def asked() -> Iterator[Animal]:
    """Columns whose names say nothing, which only the motion tells apart."""
    say = "azimuth=angle2,elevation=angle1"
    text = lines("time_s,range_m,angle1,angle2,Code", F.t, F.r, DEG_E, DEG_A, np.full(len(F.t), 7))
    units = {"units": "azimuth=deg,elevation=deg"}
    yield Animal("two angles by number", written("a.csv", text), units, asks=say, answer={"columns": say}, first_s=0)
    say = "azimuth=α,elevation=β"
    text = lines("time_s,range_m,α,β", F.t, F.r, DEG_A, DEG_E)
    yield Animal("alpha and beta", written("a.csv", text), units, asks=say, answer={"columns": say}, first_s=0)


def all_exports() -> Iterator[Animal]:
    for house in (languages, comments, printed, structures, asked):
        yield from house()
