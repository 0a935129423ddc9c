"""Tables as instruments and listings lay them out: small files of our own, each with the readings that it means."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused

N = 30
T = np.arange(N) * 1.0
X, Y, Z = 900.0 - 8 * T, -400.0 + 30 * T, 100.0 + 3 * T
R = np.sqrt(X**2 + Y**2 + Z**2)
NOISE = np.random.default_rng(1).normal(0, 2e-5, (2, N))
A, E = np.mod(np.arctan2(Y, X) + NOISE[0], 2 * np.pi), np.arcsin(Z / R) + NOISE[1]
DEG = 180 / np.pi


def sexagesimal(angle: float) -> tuple[int, int, float]:
    seconds = round(angle * DEG * 36_000) / 10
    return int(seconds // 3600), int(seconds % 3600 // 60), seconds % 60


def packed(angle: float) -> str:
    degrees, minutes, seconds = sexagesimal(angle)
    return f"{degrees}.{minutes:02d}{seconds * 10:03.0f}"


def hundreds(angle: float) -> str:
    count = round(angle * 3000 / np.pi)
    return f"{count // 100:02d}-{count % 100:02d}"


def clock(t: float) -> str:
    return f"14:25:{10 + t:06.3f}"


def rows(pattern: str, **cells: object) -> str:
    """A line for each row; a cell is a function of the row's number."""
    return "".join(pattern.format(**{k: f(j) for k, f in cells.items()}) + "\n" for j in range(N))  # type: ignore[operator]


def dms(values: np.ndarray):
    return lambda k: "  {:03d}  {:02d} {:04.1f}".format(*sexagesimal(values[k]))


CELLS = {
    "t": lambda k: f"{T[k]:.1f}", "clock": lambda k: clock(T[k]), "hms": lambda k: clock(T[k]).replace(":", " "),
    "r": lambda k: f"{R[k]:.3f}", "mm": lambda k: f"{R[k] * 1e3:.1f}", "ft": lambda k: f"{R[k] / 0.3048:.3f}",
    "a": lambda k: f"{A[k] * DEG:9.5f}", "e": lambda k: f"{E[k] * DEG:9.5f}", "z": lambda k: f"{90 - E[k] * DEG:.5f}",
    "aa": dms(A), "ee": dms(E), "ah": lambda k: hundreds(A[k]), "eh": lambda k: hundreds(E[k]),
    "ag": lambda k: f"{A[k] * DEG / 0.9:.5f}", "eg": lambda k: f"{E[k] * DEG / 0.9:.5f}",
    "zg": lambda k: f"{(90 - E[k] * DEG) / 0.9:.5f}", "as": lambda k: f"{A[k] * DEG / 0.05625:.3f}",
    "es": lambda k: f"{E[k] * DEG / 0.05625:.3f}", "ar": lambda k: f"{A[k]:.8f}",
    "zr": lambda k: f"{np.pi / 2 - E[k]:.8f}",
    "ap": lambda k: packed(A[k]), "zp": lambda k: packed(np.pi / 2 - E[k]),
    "nmi": lambda k: f"{R[k] / 1852:.6f}",
}  # fmt: skip


def page(line: str, head: str, each: int = 10) -> str:
    """A listing with its head on each page, which has a number."""
    lines = rows(line, **CELLS).splitlines()
    return "".join(
        (head.format(page=k // each + 1) if k % each == 0 else "") + f"{text}\n" for k, text in enumerate(lines)
    )


FILES = {
    "degrees, minutes and seconds in columns under one name": (
        "MISSION 4711\nIRIG-B            AZIMUTH          ELEVATION\nDDD:HH:MM:SS.SSS  DEG MIN  SEC    DEG MIN  SEC\n"
        + rows("165:{clock} {aa}  {ee}", **CELLS),
        "AE",
    ),
    "hours, minutes and seconds in columns, and heads with numbers of pages": (
        page(
            "  {hms} {ft} {a} {e}",
            "MISSION 8812   RADAR 23.14   UNCORRECTED DATA   PAGE {page}\n"
            "   ZULU TIME        RANGE     AZIMUTH   ELEVATION\n  HH MM SS.SSS       (FT)       (DEG)      (DEG)\n",
        ),
        "RAE",
    ),
    "bars, quoted numbers, and names repeated on each page": (
        page('| "{clock}" | "{r}" | "{a}" | "{e}" | OK |', "PAGE {page}\n| UTC | SLANT_RNG | AZ | EL | FLAG |\n"
             "| hh:mm:ss.s | m | deg | deg | - |\n"),
        "RAE",
    ),
    "units in brackets above names without": (
        "// Polar: range [mm], horizontal angle [deg], vertical angle from zenith [deg]\n// Time [s], Range, Hz, V\n"
        + rows("{t}, {mm}, {a}, {z}", **CELLS),
        "RAE",
    ),
    "divisions of 6000 with their hundreds apart": (
        "Время, с;Дальность, м;Азимут, д.у.;Угол места, д.у.\n" + rows("{t};{r};{ah};{eh}", **CELLS), "RAE",
    ),
    "packed degrees under the names of a total station": (
        "TIME      HR(ddd.mmssf)  VZ(ddd.mmssf)   SD(m)\n" + rows("{clock} {ap} {zp} {r}", **CELLS), "RAE",
    ),
    "German names of a total station": (
        "Zeit [s];Hz [gon];Z [gon];Schrägstrecke [m]\n" + rows("{t};{ag};{zg};{r}", **CELLS), "RAE",
    ),
    "German names of gunners": (
        "Zeit [s];Entfernung [m];Seitenwinkel [Strich];Höhenwinkel [Strich]\n"
        + rows("{t};{r};{as};{es}", **CELLS), "RAE",
    ),
    "French grades": (
        "Temps (s);Distance oblique (m);Gisement (gr);Site (gr)\n" + rows("{t};{r};{ag};{eg}", **CELLS), "RAE",
    ),
    "a tactical table": ("TIME_Z,TGT,RNG_NM,BRG_T\n" + rows("{clock}Z,TK4021,{nmi},{a}", **CELLS), "RA"),
    "readings of a rotator beside predictions": (
        "t_s,rot_az_deg,rot_el_deg,pred_az_deg,pred_el_deg,pred_range_km\n" + rows("{t},{a},{e},{e},{a},{t}", **CELLS),
        "AE",
    ),
    "replies of a Leica total station": (
        rows("2026-06-14 {clock} > %R1Q,2108:3000,1\n2026-06-14 {clock} < %R1P,0,3:0,{ar},{zr},{r}", **CELLS), "RAE",
    ),
    "flags named V beside RHO and THETA": (
        "CAT;SAC;SIC;ToD;RHO;THETA;FL;Mode3A;TrackNum;V;G\n"
        + rows("48;25;201;{t};{nmi};{a};3.3;1000;512;0;0", **CELLS), "RA",
    ),
}  # fmt: skip
FINEST = {"divisions of 6000 with their hundreds apart": 6e-4}


@pytest.mark.parametrize("name", FILES)
def test_a_layout_is_read_at_once_as_it_means(make: Make, name: str) -> None:
    text, present = FILES[name]
    log = logs.read(make(text, "log.txt"))
    np.testing.assert_allclose(np.diff(log.time_s), np.diff(T), atol=1e-3)
    for k, (letter, want) in enumerate(zip("RAE", (R, A, E), strict=True)):
        got = log.measurement[:, k]
        assert np.isfinite(got).all() == (letter in present)
        if letter in present:
            np.testing.assert_allclose(
                got, want, atol=2e-3 * R.max() * 1e-2 if letter == "R" else FINEST.get(name, 2e-6)
            )


def test_an_angle_under_an_unknown_name_is_asked_about_and_not_left_out(make: Make) -> None:
    text = "Zeit [s];Entfernung [m];Kurswinkel [deg];Höhenwinkel [deg]\n" + rows("{t};{r};{a};{e}", **CELLS)
    path = make(text)
    assert 'column "Kurswinkel [deg]" may be the azimuth. Say --columns ' in refused(path)
    log = logs.read(path, columns="azimuth=Kurswinkel [deg]")
    np.testing.assert_allclose(log.measurement[:, 1], A, atol=2e-6)
    others = "t_s;range_m;az_deg;beam width [deg];antenna height [m]\n" + rows("{t};{r};{a};2;3", **CELLS)
    assert logs.read(make(others)).measurement.shape == (N, 3)


def test_minutes_and_seconds_are_proposed_with_their_degrees(make: Make) -> None:
    sentence = refused(make(rows("165:{clock} {aa}  {ee}", **CELLS), "log.txt"))
    assert sentence.endswith(
        "--columns time=1,azimuth=2+3+4,elevation=5+6+7, which gives a target that moves like one."
    )


def test_predictions_are_not_proposed(make: Make) -> None:
    sentence = refused(make("t_s,q1,pred_range_km\n" + rows("{t},{t},{r}", **CELLS)))
    assert "range=pred" not in sentence
