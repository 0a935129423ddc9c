"""Logs as strangers write them: every notation here is read at once, as its name or its digits say."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused

N = 140
T = np.arange(N) * 0.5
X, Y, Z = 600 + 20 * T, 900 - 22 * T, 150 + 4 * T + 20 * np.sin(T / 6)
R = np.sqrt(X**2 + Y**2 + Z**2)
NOISE = np.random.default_rng(1).normal(0, 2e-5, (2, N))
A, E = (np.arctan2(X, Y) + NOISE[0]) % (2 * np.pi), np.arcsin(Z / R) + NOISE[1]
RANGES, AZIMUTHS, ELEVATIONS = R.tolist(), np.degrees(A).tolist(), np.degrees(E).tolist()
ROWS = list(zip(T.tolist(), RANGES, AZIMUTHS, ELEVATIONS, strict=True))


def clock(t: float, mark: str = ":") -> str:
    tenths = round((37865 + t) * 10)
    return f"{tenths // 36000:02d}{mark}{tenths // 600 % 60:02d}{mark}{tenths % 600 / 10:04.1f}"


def sixty(degrees: float, marks: str = "...", decimals: int = 1) -> str:
    """Degrees, minutes and seconds with marks between them."""
    ticks = round(degrees * 3600 * 10**decimals)
    whole, rest = divmod(ticks, 60 * 10**decimals)
    return f"{whole // 60}{marks[0]}{whole % 60:02d}{marks[1]}{rest / 10**decimals:0{3 + decimals}.{decimals}f}"


def minutes(degrees: float) -> str:
    whole, rest = divmod(round(degrees * 6e5), 600_000)
    return f"{whole}{rest / 1e4:07.4f}"


def dmmss(degrees: float) -> str:
    ticks = round(degrees * 360_000)
    return f"{ticks // 360_000}.{ticks // 6000 % 60:02d}{ticks % 6000:04d}"


def quadrant(degrees: float) -> str:
    north, east = not 90 < degrees < 270, degrees < 180
    angle = abs(degrees - (0 if degrees < 90 else 180 if degrees < 270 else 360))
    written = sixty(angle, "°'", 3) + '"'
    return f"{'SN'[north]} {written} {'WE'[east]}"


FILES = {
    "a name that is how the time is written": (
        "hh:mm:ss.sss;Range (m);Az (deg);El (deg)",
        lambda t, r, a, e: f"{clock(t)};{r:.3f};{a:.6f};{e:.6f}",
    ),
    "minutes and seconds": (
        "min:sec,Range (m),Az (deg),El (deg)",
        lambda t, r, a, e: f"{int(t) // 60}:{t % 60:04.1f},{r:.3f},{a:.6f},{e:.6f}",
    ),
    "seconds of a day": (
        "UTC seconds of day,Range (m),Az (deg),El (deg)",
        lambda t, r, a, e: f"{37865 + t},{r:.3f},{a:.6f},{e:.6f}",
    ),
    "digits of a time and of a date": (
        "hhmmss.ss,ddmmyy,Range (m),Az (deg),El (deg)",
        lambda t, r, a, e: f"{clock(t, '')},291126,{r:.3f},{a:.6f},{e:.6f}",
    ),
    "digits of a time with tenths": (
        "Time,Range (m),Az (deg),El (deg)",
        lambda t, r, a, e: f"{clock(t, '').replace('.', '')},{r:.3f},{a:.6f},{e:.6f}",
    ),
    "before and after an event": (
        "Time,Range (m),Az (deg),El (deg)",
        lambda t, r, a, e: f"T{'-+'[t >= 20]}00:00:{abs(t - 20):04.1f},{r:.3f},{a:.6f},{e:.6f}",
    ),
    "points between degrees, minutes and seconds": (
        "Time;Hz;Zenith;SD (m)",
        lambda t, r, a, e: f"{clock(t)};{sixty(a, decimals=3)};{sixty(90 - e, decimals=3)};{r:.3f}",
    ),
    "degrees and minutes in digits": (
        "Time,Az (DDDMM.mmmm),El (DDMM.mmmm),Range (m)",
        lambda t, r, a, e: f"{clock(t)},{minutes(a)},{minutes(e)},{r:.3f}",
    ),
    "degrees, minutes and seconds in the digits of angles without a unit": (
        "Time;HA;VA;SD",
        lambda t, r, a, e: f"{clock(t)};{dmmss(a)};{dmmss(90 - e)};{r:.3f}",
    ),
    "bearings in quadrants": (
        "Time,Bearing,Elevation (deg),Range (m)",
        lambda t, r, a, e: f"{clock(t)},{quadrant(a)},{e:.6f},{r:.3f}",
    ),
    "marks between thousands in quoted cells": (
        "Time,Range (mm),Az (deg),El (deg)",
        lambda t, r, a, e: f'{clock(t)},"{r * 1000:,.0f}",{a:.6f},{e:.6f}',
    ),
    "comments behind rows": (
        "t_s range_m az_deg el_deg",
        lambda t, r, a, e: f"{t} {r:.3f} {a:.6f} {e:.6f}{'  # lock lost' * (t % 20 == 0)}",
    ),
    "a name of comments that no row has": (
        "LabVIEW Measurement\nSeparator\tTab\n***End_of_Header***\nTime (s)\tRange (m)\tAz (deg)\tEl (deg)\tComment",
        lambda t, r, a, e: f"{t}\t{r:.3f}\t{a:.6f}\t{e:.6f}",
    ),
    "names in two lines": (
        "Time,Slant,Azimuth,Elev,SNR\nUTC,Range,Angle,Angle,\nhh:mm:ss.s,m,deg,deg,dB",
        lambda t, r, a, e: f"{clock(t)},{r:.3f},{a:.6f},{e:.6f},20",
    ),
    "names in three lines": (
        "  Time        Slant        True         Elev\n  (sec)       Range        Azimuth      Angle\n"
        "              (m)          (deg)        (deg)",
        lambda t, r, a, e: f"{t:6.2f} {r:14.3f} {a:12.6f} {e:12.6f}",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_a_notation_is_read_at_once(make: Make, name: str) -> None:
    head, row = FILES[name]
    log = logs.read(make("\n".join([head, *(row(*each) for each in ROWS)]) + "\n", "log.txt"))
    np.testing.assert_allclose(np.diff(log.time_s), np.diff(T), atol=1e-3)
    np.testing.assert_allclose(log.measurement[:, 0], R, atol=2e-3)
    np.testing.assert_allclose(log.measurement[:, 1], A, atol=2e-6)
    np.testing.assert_allclose(log.measurement[:, 2], E, atol=2e-6)


def test_time_and_date_in_the_digits_of_one_number(make: Make) -> None:
    rows = (f"{clock(t, '')[:6]}291126,{r:.3f},{a:.6f}" for t, r, a, _ in ROWS[::2])
    log = logs.read(make("\n".join(["hhmmssddmmyy,range_m,brg_deg", *rows]) + "\n"))
    np.testing.assert_allclose(np.diff(log.time_s), 1.0)
    assert log.time_s[0] == 37865


def plain(rows: int = N, el: np.ndarray = E, az: np.ndarray = A) -> str:
    each = zip(T[:rows].tolist(), RANGES, np.degrees(az).tolist(), np.degrees(el).tolist(), strict=False)
    return "t_s,range_m,az_deg,el_deg\n" + "".join(f"{t},{r:.3f},{a:.6f},{e:.6f}\n" for t, r, a, e in each)


def test_zeros_behind_the_rows_are_left_out_and_so_is_a_row_that_breaks_off(make: Make) -> None:
    log = logs.read(make(plain() + "\0" * 400))
    assert len(log.time_s) == N
    assert log.understood["file"].endswith("400 zeros behind the rows")
    for broken in ("70.0,63", "70.0,63" + "\0" * 400):
        log = logs.read(make(plain() + broken))
        assert len(log.time_s) == N
        assert any('the last line, "70.0,63", is cut off' in note for note in log.remarks)


def test_rows_that_are_too_short_for_names_in_two_lines_are_refused(make: Make) -> None:
    rows = (f"{t},{r:.3f},{a:.6f}" for t, r, a, _ in ROWS)
    said = refused(make("\n".join(["Radar,Radar,Radar", "t_s,range_m,az_deg,el_deg", *rows]) + "\n"))
    assert "has 3 cells where the header has 4" in said


def test_marks_of_comments_in_cells_of_words_are_left(make: Make) -> None:
    rows = (f"{t},{r:.3f},{a:.6f},{e:.6f},gate 3 # lost" for t, r, a, e in ROWS)
    log = logs.read(make("\n".join(["t_s,range_m,az_deg,el_deg,remark", *rows]) + "\n"), keep_columns=True)
    assert log.extra is not None
    assert log.extra.column("remark")[0].as_py() == "gate 3 # lost"
