"""Formats of ranging, of satellites, ships, surveyors and cameras, each made here from its public description."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from tests.files.zoo.animals import DEG_A, DEG_E, FIRST_UTC, SOD, F
from tests.files.zoo.flight import MIDNIGHT_START, START, Animal, Flight, clock, flight, written

UTC = {"first_s": SOD, "utc": FIRST_UTC}
RANGE_ONLY, ANGLES_ONLY, FLAT = (False, True, True), (True, False, False), (False, False, True)
LIGHT_MPS = 299_792_458.0
NIGHT = {"first_s": float(F.sod(MIDNIGHT_START)[0]), "utc": "2024-05-31T23:59:30"}


def _crd(
    event: int = 2, kind: str = "10", ways: int = 2, start: np.datetime64 = START, station: str = "STL3", which: int = 0
) -> str:
    """A pass, with weather, calibrations and comments; version 2 in small letters, version 1 in capitals."""
    f: Flight = flight(which)
    shift = {0: 0.5, 1: 0.0, 2: -0.5}[event] * (ways == 2)
    y, mo, d = str(start)[:10].split("-")
    hour, minute, second = str(start)[11:19].split(":")
    data = 1 if kind == "11" else 0
    rows = [
        f"h1 CRD 2 {y} {mo} {d} 12", f"h2 {station} 7825 90 01 4 ILRS", "h3 target1 0003902 8002 026405 0 1 0",
        f"h4 {data} {y} {mo} {d} {hour} {minute} {second} {y} {mo} {d} 13 00 00 0 0 0 0 1 0 {ways} 0",
        "c0 0 532.10 IDAA IDAB IDAJ IDAV", "00 a comment", "20 45296.5 923.74 289.42 28.1 0",
        "40 45296.0 0 IDAA 1139 264 69.592 160524.4 112.1 23.3 0.100 -0.400 -1.3 2 3 0",
        "30 45290.0 215.0 15.0 0 2 0",
    ]  # fmt: skip
    for second_s, r in zip(f.sod(start).tolist(), f.r.tolist(), strict=True):
        time = ways * r / LIGHT_MPS
        more = "2 0 0 0 -1 -1" if kind == "10" else "120 7 48.0 -1 -1 -1.0 -1.0 0"
        rows.append(f"{kind} {(second_s + shift * time) % 86400:.12f} {time:.15f} IDAA {event} {more}")
    return "\n".join([*rows, "50 IDAA 67.0 0.307 2.492 -11.0 0", "h8"]) + "\n"


def laser() -> Iterator[Animal]:
    """ILRS CRD."""

    def animal(name: str, text: str, file: str = "a.frd", **more: Any) -> Animal:
        return Animal(f"CRD, {name}", written(file, text), **{"absent": RANGE_ONLY, **UTC, **more})

    yield animal("full rate", _crd() + "h9\n")
    yield animal("version 1 in capitals", _crd().upper().replace("CRD 2", "CRD  1") + "H9\n", "a.txt")
    yield animal("normal points", _crd(kind="11"), "a.npt")
    yield animal("over midnight", _crd(start=MIDNIGHT_START), **NIGHT)
    yield animal("timed on reception", _crd(event=0))
    yield animal("timed at the target", _crd(event=1))
    yield animal("one way", _crd(ways=1, event=1))
    ask = {"asks": "--where station=STL3", "answer": {"where": "station=ZIML"}, "which": 1}
    yield animal("two stations", _crd() + _crd(station="ZIML", which=1) + "h9\n", **ask)
    measured = "".join(f"30 {s:.6f} {a:.6f} {e:.6f} 0 3 0\n" for s, a, e in zip(F.sod(), DEG_A, DEG_E, strict=True))
    angles = "".join(line if not line.startswith("10 ") else "" for line in _crd().splitlines(keepends=True))
    yield animal("measured angles", angles.replace("h8\n", f"{measured}h8\n"), absent=ANGLES_ONLY)


def _tdm(meta: str, rows: Callable[[str, float, float, float], str], which: int = 0, start: np.datetime64 = START,
         doy: bool = False) -> str:  # fmt: skip
    f = flight(which)
    epochs = [moment[:-3] for moment in clock(f.moments(start), "%Y-%jT%H:%M:%S.%f" if doy else "%Y-%m-%dT%H:%M:%S.%f")]
    data = "".join(
        rows(t, r / 1e3, a, e) for t, r, a, e in zip(epochs, f.r, np.degrees(f.a), np.degrees(f.e), strict=True)
    )
    lines = "".join(f"  {line.strip()}\n" for line in meta.split(";"))
    return f"META_START\nCOMMENT a pass\n{lines}META_STOP\nDATA_START\nCOMMENT here\n{data}DATA_STOP\n"


def _azel(t: str, r: float, a: float, e: float) -> str:
    return f"\tRANGE = {t} {r:.8f}\n\tANGLE_1 = {t} {a:.8f}\n\tANGLE_2 = {t} {e:.8f}\n\tMAG = {t} 5.0\n"


HEAD = "CCSDS_TDM_VERS = 2.0\nCOMMENT made here\nCREATION_DATE = 2024-06-01T00:00:00\nORIGINATOR = X\n"
ONE = "TIME_SYSTEM = UTC; PARTICIPANT_1 = NORTH; PARTICIPANT_2 = SAT; MODE = SEQUENTIAL; PATH = 2,1; ANGLE_TYPE = AZEL"


def messages() -> Iterator[Animal]:
    """CCSDS TDM."""

    def animal(name: str, text: str, file: str = "a.tdm", **more: Any) -> Animal:
        return Animal(f"TDM, {name}", written(file, text), **{**UTC, **more})

    two_way = ONE.replace("PATH = 2,1", "PATH = 1,2,1")
    yield animal("one way", HEAD + _tdm(ONE, _azel))
    yield animal("days of the year", HEAD.replace("2.0", "1.0") + _tdm(ONE, _azel, doy=True), "a.txt")
    yield animal(
        "two ways", HEAD + _tdm(two_way, _azel), asks="--columns range=range", answer={"columns": {"range": "range"}}
    )
    whole = _tdm(two_way, lambda t, r, a, e: _azel(t, 2 * r, a, e))
    yield animal(
        "there and back", HEAD + whole, asks="range=range_halved", answer={"columns": {"range": "range_halved"}}
    )
    seconds = _tdm(
        f"{ONE}; RANGE_UNITS = s",
        lambda t, r, a, e: _azel(t, r * 1e3 / LIGHT_MPS, a, e).replace("RANGE = ", "RANGE =  "),
    )
    yield animal("light seconds", HEAD + seconds, tolerance=2.0)
    both = HEAD + _tdm(ONE, _azel) + "\n" + _tdm(ONE.replace("NORTH", "SOUTH"), _azel, 1)
    yield animal("two stations", both, asks="--where station=NORTH", answer={"where": "station=SOUTH"}, which=1)
    satellites = HEAD + _tdm(ONE, _azel) + _tdm(ONE.replace("SAT", "OTHER"), _azel, 1)
    yield animal("two satellites", satellites, asks="--target target=SAT", answer={"target": "target=OTHER"}, which=1)
    tai = _tdm(ONE.replace("UTC", "TAI"), _azel, start=START + np.timedelta64(37, "s"))
    yield animal("atomic time", HEAD + tai)
    short = _tdm(f"{ONE}; CORRECTION_RANGE = 0.5; CORRECTIONS_APPLIED = NO", lambda t, r, a, e: _azel(t, r - 0.5, a, e))
    yield animal("a correction that is not applied", HEAD + short)
    stars = _tdm(ONE.replace("AZEL", "RADEC"), lambda t, r, a, e: f"ANGLE_1 = {t} {a:.6f}\nANGLE_2 = {t} {e:.6f}\n")
    yield animal("beside right ascensions", HEAD + _tdm(ONE, _azel) + stars)
    yield animal("XML", _xml(), "a.xml")


def _xml() -> str:
    def observation(t: str, key: str, value: float) -> str:
        return f"<observation>\n<EPOCH>{t}</EPOCH>\n<{key}>{value:.8f}</{key}>\n</observation>\n"

    meta = "".join(f"<{k.strip()}>{v.strip()}</{k.strip()}>\n" for k, v in (pair.split("=") for pair in ONE.split(";")))
    rows = (
        observation(t[:-3], key, value)
        for t, *values in zip(clock(F.moments(), "%Y-%m-%dT%H:%M:%S.%f"), F.r / 1e3, DEG_A, DEG_E, strict=True)
        for key, value in zip(("RANGE", "ANGLE_1", "ANGLE_2"), values, strict=True)
    )
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<tdm id="CCSDS_TDM_VERS" version="1.0">\n<header><ORIGINATOR>X'
        f"</ORIGINATOR></header>\n<body><segment>\n<metadata>\n<COMMENT>a</COMMENT>{meta}</metadata>\n<data>\n"
        f"{''.join(rows)}</data></segment></body></tdm>\n"
    )


def checked(body: str) -> str:
    """A sentence with its checksum."""
    total = 0
    for letter in body:
        total ^= ord(letter)
    return f"${body}*{total:02X}"


def _ttm(k: int, own: str = "", reference: str = "T", unit: str = "N", which: int = 0, turned: float = 0.0) -> str:
    f = flight(which)
    length = {"N": 1852.0, "K": 1000.0, "S": 1609.344}[unit]
    bearing = (np.degrees(f.a[k]) - turned) % 360
    polar = f"{f.r[k] / length:.6f},{bearing:.5f},{reference}"
    return checked(f"RATTM,{which + 1:02d},{polar},12.3,45.6,T,0.5,3.2,{unit},TGT{which},T,,{own},A")


def ships() -> Iterator[Animal]:
    """NMEA 0183."""
    rows = range(len(F.t))
    times = [each[:-3] for each in clock(F.moments(), "%H%M%S.%f")]
    stamps = [each[:-3] for each in clock(F.moments(), "%Y-%m-%d %H:%M:%S.%f")]
    unix = [round(float(each)) for each in F.moments().astype("datetime64[ms]").astype(np.int64)]

    def animal(name: str, lines: list[str], **more: Any) -> Animal:
        return Animal(f"NMEA, {name}", written("a.log", "\r\n".join(lines)), **{"absent": FLAT, **UTC, **more})

    def zda(k: int, all_times: list[str] = times, day: str = "31,05,2024") -> str:
        return checked(f"GPZDA,{all_times[k]},{day},00,00")

    yield animal("times of their own", [_ttm(k, times[k]) for k in rows], utc="")
    twice = [[_ttm(k, times[k]), _ttm(k, times[k]).replace(",T,", ",R,", 1)] for k in rows]
    yield animal("sentences with a wrong checksum among others", [each for pair in twice[:40] for each in pair]
                 + [each for each, _ in twice[40:]], utc="")  # fmt: skip
    yield animal("the clock of ZDA", [line for k in rows for line in (zda(k), _ttm(k))])
    rmc = [checked(f"GPRMC,{t},A,4807.0,N,01131.0,E,000.1,084.4,310524,,,A") for t in times]
    yield animal("the clock of RMC, kilometres", [line for k in rows for line in (rmc[k], _ttm(k, unit="K"))])
    yield animal("the logger's stamps", [f"{stamps[k]} {_ttm(k, unit='S')}" for k in rows])
    yield animal("tag blocks", [f"\\s:RA0001,c:{unix[k]}*2F\\{_ttm(k)}" for k in rows])
    bow = [line for k in rows for line in (zda(k), checked("HEHDT,077.5,T"), _ttm(k, reference="R", turned=77.5))]
    yield animal("bearings from the bow", bow)
    bare = [line for k in rows for line in (zda(k), _ttm(k, reference="R"))]
    say = {"azimuth": "bearing_deg"}
    yield animal("no heading", bare, asks="--columns azimuth=bearing_deg", answer={"columns": say})
    two = [line for k in rows for line in (zda(k), _ttm(k), _ttm(k, which=1))]
    ask = {"asks": "--target target_number=01", "answer": {"target": "target_number=02"}, "which": 1}
    yield animal("two targets", two, **ask)
    late = [each[:-3] for each in clock(F.moments(MIDNIGHT_START), "%H%M%S.%f")]
    over = [line for k in rows for line in (zda(k, late, "31,05,2024" if late[k] > "12" else "01,06,2024"), _ttm(k))]
    yield animal("over midnight", over, **NIGHT)


def lists() -> Iterator[Animal]:
    """Lines of several kinds, of cameras and of surveyors."""
    stamps = [each[:-3] for each in clock(F.moments(), "%Y-%m-%dT%H:%M:%S.%f")]
    together = "".join(
        f"{t}   AZ_EL  Fucino   {a:.6f}  {e:.6f}\n" for t, a, e in zip(stamps, DEG_A, DEG_E, strict=True)
    )
    yield Animal("Orekit, angles", written("a.aer", f"# a comment\n\n{together}"), absent=ANGLES_ONLY, **UTC)
    far = "".join(f"{t}   RANGE  Fucino   {r / 1e3:.6f}\n" for t, r in zip(stamps, F.r, strict=True))
    yield Animal("Orekit, ranges", written("a.aer", far), absent=RANGE_ONLY, **UTC)
    unix = F.moments().astype("datetime64[us]").astype(np.int64).tolist()
    mixed = "".join(
        f"L\t3.1e-01\t5.8e-01\t{t - 50_000}\t6e-01\t6e-01\nR\t{r:.6e}\t{a:.6e}\t4.89e+00\t{t}\t8.5e-01\t6.0e-01\n"
        for t, r, a in zip(unix, F.r, (F.a + np.pi) % (2 * np.pi) - np.pi, strict=True)
    )
    yield Animal("a radar among lidar", written("a.txt", mixed), absent=FLAT, **UTC)
    yield Animal("FTPdetectinfo", written("FTPdetectinfo_X.txt", _meteor()), absent=ANGLES_ONLY, clock=2e-3, **UTC)
    words = "".join(_gsi(k) for k in range(len(F.t)))
    yield Animal("GSI of 16 digits with word 51", written("a.gsi", words), **UTC)


def _meteor() -> str:
    rule = "-------------------------------------------------------\n"
    head = (
        f"Meteor Count = 000001\n{rule}Processed with RMS 1.0 on 2024-06-01 03:17:57 UTC\n{rule}FF  folder = /a\n{rule}"
        "Cam# Meteor# #Segments fps hnr mle bin Pix/fm Rho Phi\nPer segment: Frame# Col Row RA Dec Azim Elev Inten\n"
        f"{rule}FF_UK002F_20240531_123456_000_0103424.fits\nRecalibrated with RMS on: 2024-06-01 03:17:57 UTC\n"
        "UK002F 0001 0120 0025.00 000.0 000.0  00.0   2.8 0271.5 0352.6\n"
    )
    return head + "".join(
        f"{25 * t:09.4f} 0882.00 0600.00 350.686488 +25.013576 {a:010.6f} {e:+010.6f} 000000023 +06.14\n"
        for t, a, e in zip(F.t, DEG_A, DEG_E, strict=True)
    )


def _gsi(k: int) -> str:
    moment = F.moments()[k].item()
    stamp = (f"{moment:%y%S}{moment.microsecond // 1000:03d}0", f"{moment:%m%d%H%M}")
    return (
        f"*11{k + 1:04d}+{k + 1:016d} 18....+00000000{stamp[0]} 19....+00000000{stamp[1]} "
        f"21.323+{round(DEG_A[k] * 1e5):016d} 22.323+{round((90 - DEG_E[k]) * 1e5):016d} "
        f"31..06+{round(F.r[k] * 1e4):016d} 51....+0000000000+00034 87..10+{1500:016d} \n"
    )


def all_standards() -> Iterator[Animal]:
    for kind in (laser, messages, ships, lists):
        yield from kind()
