"""Good logs made ambiguous or wrong, as people do it: how each is read. Run `python -m tests.files.mutations`.

right      read at once as it is meant, and nothing is assumed of what it means that may be otherwise
if         read at once as it is meant; the verdict names what is assumed
asked      a question; `led` if the one answer that it suggests leads to something else
WRONG      read as something else without a word; the verdict is given with it
wrong if   read as something else; the verdict names an assumption that does not hold
"""

from __future__ import annotations

import re
import shlex
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ftproc import pipeline
from ftproc.errors import InputError
from ftproc.files.reading import logs
from ftproc.records import FloatArray, MeasurementLog
from ftproc.settings import Station
from ftproc.simulation import simulate

FLIGHTS = {"cruise": 60.0, "radar": 400.0, "manoeuvre-clean": 40.0, "overhead": 40.0}
_TOLERANCE = (0.02, 2e-3, 2e-3)  # relative of ranges, rad


class Flight(NamedTuple):
    """t: s from 0. r: m. a: rad from 0 to a turn. e: rad."""

    t: FloatArray
    r: FloatArray
    a: FloatArray
    e: FloatArray


class Kind(NamedTuple):
    """head: the line of names, or "". columns: of a flight. told: whether the motion of a straight flight tells what is
    meant where no name does, so that no question is needed. unknowable: no program can know."""

    name: str
    head: str
    columns: Callable[[Flight], list[object]]
    told: bool = False
    unknowable: bool = False


@cache
def flight(name: str, rows: int = 0) -> Flight:
    """A simulated flight without outliers, or the first rows of it."""
    log = simulate(name, seed=5, duration_s=FLIGHTS[name], outliers="none").log
    keep = np.flatnonzero(np.isfinite(log.measurement).all(1) & (np.diff(log.time_s, prepend=-1.0) > 0))
    keep = keep[:: max(1, len(keep) // rows)][:rows] if rows else keep
    r, a, e = log.measurement[keep].T
    return Flight(log.time_s[keep] - log.time_s[keep[0]], r, (np.pi / 2 - a) % (2 * np.pi), e)


def _deg(angle: FloatArray, turn: float = 360.0) -> FloatArray:
    return angle * (turn / (2 * np.pi))


def _hhmmss(t: FloatArray) -> list[str]:
    whole = 45290 + np.round(t, 3)
    return [f"{int(v // 3600):02d}{int(v // 60 % 60):02d}{v % 60:06.3f}" for v in whole]


def _dms(angle: FloatArray) -> list[str]:
    seconds = np.round(_deg(angle) * 3600).astype(int)
    return [f"{v // 3600}.{v // 60 % 60:02d}{v % 60:02d}" for v in seconds]


def _zenith(angle: FloatArray) -> FloatArray:
    return np.pi / 2 - angle


BARE, DEG, RAD = "t,R,A,E", "time_s,range_m,az_deg,el_deg", "time_s,range_m,az_rad,el_rad"
OWN = "time_s,range_m,azimuth_rad,elevation_rad"


def kinds() -> Iterator[Kind]:
    """All kinds of mutation."""
    yield Kind("nothing changed, SI", OWN, lambda f: [*f])
    yield Kind("nothing changed, deg", DEG, lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)])
    yield from _angles()
    yield from _lengths()
    yield from _times()
    yield from _exchanged()
    yield from _without_names()


def _angles() -> Iterator[Kind]:
    for name, turn in (("rad", 2 * np.pi), ("deg", 360), ("gon", 400), ("mil", 6400), ("mil6000", 6000),
                       ("mrad", 2e3 * np.pi)):  # fmt: skip
        told = name in ("rad", "deg")
        yield Kind(f"{name}, unsaid", BARE, lambda f, u=turn: [f.t, f.r, _deg(f.a, u), _deg(f.e, u)], told)
    for name, turn in (("rad", 2 * np.pi), ("gon", 400), ("mil", 6400)):
        yield Kind(f"{name} named deg", DEG, lambda f, u=turn: [f.t, f.r, _deg(f.a, u), _deg(f.e, u)])
    yield Kind("arcmin named deg", DEG, lambda f: [f.t, f.r, _deg(f.a, 21600), _deg(f.e, 21600)])
    yield Kind("mrad named rad", RAD, lambda f: [f.t, f.r, f.a * 1e3, f.e * 1e3])
    yield Kind("elevations from the nadir", DEG, lambda f: [f.t, f.r, _deg(f.a), 90 + _deg(f.e)], unknowable=True)
    yield Kind("deg named rad", RAD, lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("gon named deg in words", "time,range (m),Azimuth (deg),Elevation (deg)",
               lambda f: [f.t, f.r, _deg(f.a, 400), _deg(f.e, 400)])  # fmt: skip
    yield Kind("rad beside deg, unsaid", BARE, lambda f: [f.t, f.r, _deg(f.a), f.e], True)
    yield Kind("deg beside rad, unsaid", BARE, lambda f: [f.t, f.r, f.a, _deg(f.e)], True)
    yield Kind("rad beside deg, named deg", DEG, lambda f: [f.t, f.r, _deg(f.a), f.e])
    yield Kind("deg beside rad, named deg", DEG, lambda f: [f.t, f.r, f.a, _deg(f.e)])
    yield Kind("half a turn each way", BARE, lambda f: [f.t, f.r, (_deg(f.a) + 180) % 360 - 180, _deg(f.e)], True)
    yield Kind("zenith, unsaid", "t,range_m,A,E", lambda f: [f.t, f.r, _deg(f.a), _deg(_zenith(f.e))], True)
    yield Kind("zenith named deg", DEG, lambda f: [f.t, f.r, _deg(f.a), _deg(_zenith(f.e))])
    yield Kind("zenith named rad", RAD, lambda f: [f.t, f.r, f.a, _zenith(f.e)])
    yield Kind("zenith in own names", OWN, lambda f: [f.t, f.r, f.a, _zenith(f.e)])
    yield Kind("deg in own names", OWN, lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("exchanged in own names", OWN, lambda f: [f.t, f.r, f.e, f.a])
    yield Kind("km in own names", OWN, lambda f: [f.t, f.r / 1e3, f.a, f.e], unknowable=True)
    yield Kind("ms in own names", OWN, lambda f: [f.t * 1e3, f.r, f.a, f.e])
    yield Kind("zenith called V", "t,range_m,Hz_deg,V_deg", lambda f: [f.t, f.r, _deg(f.a), _deg(_zenith(f.e))], True)
    yield Kind("V of an elevation", "t,range_m,Hz_deg,V_deg", lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)], True)
    yield Kind("downwards", DEG, lambda f: [f.t, f.r, _deg(f.a), -_deg(f.e)], unknowable=True)
    yield Kind("packed degrees", DEG, lambda f: [f.t, f.r, _dms(f.a), _dms(f.e)])
    yield Kind("packed degrees, unsaid", BARE, lambda f: [f.t, f.r, _dms(f.a), _dms(f.e)])
    yield Kind("of 20 rows, rad named deg", DEG, lambda f: [f.t, f.r, f.a, f.e])
    yield Kind("of 20 rows, deg", BARE, lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("of 20 rows, rad beside deg", BARE, lambda f: [f.t, f.r, _deg(f.a), f.e])
    yield Kind("of 20 rows, zenith", DEG, lambda f: [f.t, f.r, _deg(f.a), _deg(_zenith(f.e))], unknowable=True)


def _lengths() -> Iterator[Kind]:
    head = "time_s,range,az_deg,el_deg"
    for name, size in (("ft", 0.3048), ("yd", 0.9144), ("km", 1e3), ("nmi", 1852.0), ("kft", 304.8), ("mm", 1e-3),
                       ("cm", 1e-2), ("counts of 0.5 m", 0.5)):  # fmt: skip
        yield Kind(f"{name}, unsaid", head, lambda f, u=size: [f.t, f.r / u, _deg(f.a), _deg(f.e)])
    yield Kind("ft named m", DEG, lambda f: [f.t, f.r / 0.3048, _deg(f.a), _deg(f.e)], unknowable=True)
    words = "Time (s),Range (m),Az (deg),El (deg)"
    yield Kind("km named m", words, lambda f: [f.t, f.r / 1e3, _deg(f.a), _deg(f.e)])
    yield Kind("there and back, named m", DEG, lambda f: [f.t, f.r * 2, _deg(f.a), _deg(f.e)], unknowable=True)
    yield Kind("of 20 rows, km", head, lambda f: [f.t, f.r / 1e3, _deg(f.a), _deg(f.e)])
    yield Kind("of 20 rows, ft", head, lambda f: [f.t, f.r / 0.3048, _deg(f.a), _deg(f.e)])


def _times() -> Iterator[Kind]:
    head = "t,range_m,az_deg,el_deg"
    for name, size in (("ms", 1e-3), ("us", 1e-6), ("min", 60.0), ("h", 3600.0), ("frames at 25 Hz", 0.04)):
        yield Kind(f"{name}, unsaid", head, lambda f, u=size: [f.t / u, f.r, _deg(f.a), _deg(f.e)], name == "ms")
    yield Kind("numbers of rows", head, lambda f: [np.arange(len(f.t)), f.r, _deg(f.a), _deg(f.e)])
    yield Kind("ms named s", DEG, lambda f: [f.t * 1e3, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("hhmmss", "time,range_m,az_deg,el_deg", lambda f: [_hhmmss(f.t), f.r, _deg(f.a), _deg(f.e)])
    yield Kind("hhmmss named s", DEG, lambda f: [_hhmmss(f.t), f.r, _deg(f.a), _deg(f.e)])
    yield Kind("of 20 rows, ms", head, lambda f: [f.t * 1e3, f.r, _deg(f.a), _deg(f.e)])


def _exchanged() -> Iterator[Kind]:
    yield Kind("angles exchanged, named", DEG, lambda f: [f.t, f.r, _deg(f.e), _deg(f.a)])
    yield Kind("angles exchanged, rad", RAD, lambda f: [f.t, f.r, f.e, f.a])
    yield Kind("theta and phi", "t,range_m,theta_deg,phi_deg", lambda f: [f.t, f.r, _deg(f.e), _deg(f.a)])


def _without_names() -> Iterator[Kind]:
    yield Kind("no names", "", lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("no names, the range last", "", lambda f: [f.t, _deg(f.a), _deg(f.e), f.r / 1e3])
    yield Kind("no names, a sensor's number", "", lambda f: [f.t, [3] * len(f.t), f.r, _deg(f.a), _deg(f.e)])
    yield Kind("no names, a number of the row", "", lambda f: [np.arange(len(f.t)), f.t, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("strange names", "c1,c2,c3,c4", lambda f: [f.t, f.r, _deg(f.a), _deg(f.e)])
    yield Kind("places only", "time,latitude,longitude,height", _places)
    yield Kind("places only, no names", "", _places)
    yield Kind("strange places", "zeit,breite,laenge,hoehe", _places)


def _places(f: Flight) -> list[object]:
    x, y, z = f.r * np.cos(f.e) * np.sin(f.a), f.r * np.cos(f.e) * np.cos(f.a), f.r * np.sin(f.e)
    return [f.t, 48 + y / 111e3, 11 + x / 74e3, 600 + z]


def write(kind: Kind, name: str, path: Path) -> Flight:
    """Write a log of a kind; the flight of its rows."""
    rows = 20 if kind.name.startswith("of 20") else 0
    mine = flight(name, rows)
    cells = [[f"{v:.8f}" if isinstance(v, float) else str(v) for v in np.asarray(c).tolist()]
             for c in kind.columns(mine)]  # fmt: skip
    body = "\n".join(",".join(row) for row in zip(*cells, strict=True)) + "\n"
    path.write_text((f"{kind.head}\n" if kind.head else "") + body)
    return mine


def is_meant(log: MeasurementLog, mine: Flight) -> bool:
    """Whether a log has the readings and times of a flight."""
    if len(log) != len(mine.t) or np.isnan(log.measurement).any():
        return False
    r, a, e = log.measurement.T
    turned = (a - mine.a + np.pi) % (2 * np.pi) - np.pi
    off = np.abs(np.column_stack([r / mine.r - 1, turned, e - mine.e])).max(0)
    late = np.abs(log.time_s - log.time_s[0] - mine.t).max()
    return bool((off <= _TOLERANCE).all() and late < 0.02)


def suggested(said: str) -> list[dict[str, str]]:
    """The answers in a question, each as options."""
    found: list[dict[str, str]] = []
    for key, value in re.findall(r"--(columns|units|elevation-from) ((?:'[^']*'|[^\s'])+)", said):
        value = shlex.split(value.rstrip(".,;"))[0]
        if re.search("NAME|UNIT", value):
            continue
        if not found or key in found[-1]:
            found.append({})
        found[-1][key] = value
    return found


def read(path: Path, options: dict[str, str]) -> MeasurementLog:
    station = Station(azimuth_from="north", elevation_from=options.get("elevation-from"))
    return logs.read(path, units=options.get("units"), columns=options.get("columns"), station=station)


def judged(kind: Kind, name: str, path: Path, verdicts: bool = True) -> str:
    """How a log is read, see above."""
    mine = write(kind, name, path)
    try:
        log = read(path, {})
    except InputError as question:
        return _led(mine, path, str(question))
    condition = " if" if log.understood["assumed"] else ""
    if is_meant(log, mine):
        return condition.strip() or "right"
    if condition or not verdicts:
        return f"wrong{condition}"
    return f"WRONG {pipeline.filter_log(log).metadata['summary']['trust']['verdict']}"


def _led(mine: Flight, path: Path, said: str) -> str:
    taken: dict[str, str] = {}
    for _ in range(5):
        answers = suggested(said)
        if len(answers) != 1:
            return f"asked {len(answers)}"
        for key, value in answers[0].items():
            taken[key] = f"{taken[key]},{value}" if key in taken and key != "elevation-from" else value
        try:
            log = read(path, taken)
        except InputError as question:
            said = str(question)
            continue
        return "asked, right" if is_meant(log, mine) else "led" if not log.understood["assumed"] else "led if"
    return "asked"


def main(*names: str) -> int:
    counts: Counter[str] = Counter()
    asked_in_vain = told = 0
    with tempfile.TemporaryDirectory() as directory:
        for kind in kinds():
            if names and not any(name in kind.name for name in names):
                continue
            found = [judged(kind, name, Path(directory) / "a.csv") for name in FLIGHTS]
            counts.update(found)
            told += len(found) * kind.told
            asked_in_vain += kind.told * sum(each.startswith(("asked", "led")) for each in found)
            print(f"{kind.name:34.34s}" + "".join(f"{each:18s}" for each in found), flush=True)
    print(dict(counts), f"of {counts.total()}; of {told} that the motion tells, {asked_in_vain} are asked about")
    return int(any(each.startswith(("WRONG consistent", "led")) for each in counts))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
