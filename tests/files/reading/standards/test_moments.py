"""When a reading of a standard's file was taken."""

import datetime

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make

FLIGHT_S = 0.05  # there and back


@pytest.mark.parametrize(("event", "ways", "shift"), [(0, 2, -0.5), (1, 2, 0.0), (2, 2, 0.5), (2, 1, 0.0)])
def test_a_laser_range_is_timed_when_the_light_was_at_the_target(
    make: Make, event: int, ways: int, shift: float
) -> None:
    head = (
        "h1 CRD 2 2024 5 31 12\nh2 X 1 1 1 4 ILRS\nh3 a 1 1 1 0 1 0\nh4 0 2024 5 31 1 0 0 2024 5 31 2 0 0 0 0 0 0 1 0"
    )
    head += f" {ways} 0\n"
    rows = "".join(f"10 {3600 + k} {FLIGHT_S} std {event} 0 0 0 -1 -1\n" for k in range(30))
    log = logs.read(make(head + rows + "h8\nh9\n", "a.frd"))
    np.testing.assert_allclose(log.time_s, 3600 + np.arange(30) + shift * FLIGHT_S, atol=1e-8)
    np.testing.assert_allclose(log.measurement[:, 0], 299_792_458.0 * FLIGHT_S / ways)


@pytest.mark.parametrize(
    ("before", "first_s"),
    [
        ("2024-05-31T12:00:{k:02d}.250Z,", 43200.25),
        ("[12:00:{k:02d}.250] ", 43200.25),
        ("17171568{k:02d}.25;RA;", 43200.25),
        ("\\s:RA,c:17171568{k:02d}250*1A\\", 43200.25),
    ],
)
def test_the_time_that_a_logger_writes_before_a_sentence(make: Make, before: str, first_s: float) -> None:
    lines = [before.format(k=k) + f"$RATTM,01,{3 + k / 100},45.5,T,1,2,T,3,4,N,A,T,,,A\n" for k in range(30)]
    log = logs.read(make("".join(lines), "a.log"))
    np.testing.assert_allclose(log.time_s, first_s + np.arange(30), atol=1e-6)


def test_lost_targets_are_left_out_and_a_moving_ship_is_said(make: Make) -> None:
    ship = "$GPRMC,1200{k:02d}.00,A,4807.0,N,01131.0,E,012.5,084.4,310524,,,A\n$HETHS,350.0,A\n"
    radar = "$RATTM,01,{r},20.5,R,1,2,T,3,4,N,A,{status},,,A\n"
    lines = [(ship + radar).format(k=k, r=3 + k / 100, status="L" if k % 10 == 9 else "T") for k in range(40)]
    log = logs.read(make("".join(lines), "a.log"))
    assert len(log) == 36
    assert np.degrees(log.measurement[:, 1]) == pytest.approx(10.5)
    assert "4 sentences of lost targets, left out" in log.remarks
    assert any("its motion is not taken out" in remark for remark in log.remarks)


def test_epochs_of_clocks_that_are_not_utc(make: Make) -> None:
    meta = "META_START\nTIME_SYSTEM = {}\nPARTICIPANT_1 = A\nPATH = 2,1\nMETA_STOP\nDATA_START\n"
    data = "".join(f"RANGE = 2024-05-31T12:00:{k:02d} {700 + k}\n" for k in range(30))
    first = {}
    for system in ("UTC", "GPS", "TAI", "TT", "SCLK"):
        log = logs.read(make("CCSDS_TDM_VERS = 2.0\n" + meta.format(system) + data, f"{system}.tdm"))
        first[system] = log.time_s[0]
        assert any("SCLK are taken for UTC" in remark for remark in log.remarks) == (system == "SCLK")
    expected = {"UTC": 43200, "GPS": 43182, "TAI": 43163, "TT": 43130.816, "SCLK": 43200}
    assert first == pytest.approx(expected)


WRITTEN = (
    *("%Y-%j-%H:%M:%S.%f", "%Y/%j-%H:%M:%S.%f", "%Y.%j.%H:%M:%S.%f", "%Y%jT%H%M%S.%f", "%Y-%jT%H:%M:%S.%fZ"),
    *("%y-%j-%H:%M:%S.%f", "%y%j %H:%M:%S.%f", "%d%b%Y:%H:%M:%S.%f", "%d%b%y %H:%M:%S.%f", "%Y-%b-%d %H:%M:%S.%f"),
    *("%Y-%m-%d-%H-%M-%S.%f", "%Y_%m_%d_%H_%M_%S_%f", "%Y-%m-%d %H.%M.%S.%f", "%d/%m/%Y - %H:%M:%S.%f"),
    *("%a, %d %b %Y %H:%M:%S.%f GMT", "%A, %B %d, %Y %I:%M:%S.%f %p", "%a %b %d %H:%M:%S.%f %Y"),
    *("%Y年%m月%d日 %H:%M:%S.%f", "%Y年%m月%d日%H时%M分%S.%f秒"),
)


@pytest.mark.parametrize("written", WRITTEN)
def test_dates_and_times_as_printouts_write_them(make: Make, written: str) -> None:
    first = datetime.datetime(2023, 6, 14, 23, 59, 45, 250_000)  # passes midnight
    cells = [(first + datetime.timedelta(seconds=0.5 * k)).strftime(written) for k in range(60)]
    log = logs.read(make("Time;range_m;az_deg\n" + "".join(f"{cell};{900 + k};20\n" for k, cell in enumerate(cells))))
    np.testing.assert_allclose(log.time_s, 86385.25 + 0.5 * np.arange(60), atol=1e-6)
    assert log.epoch == "2023-06-14T00:00:00Z"


@pytest.mark.parametrize("written", ["%Y%j%H%M%S", "%y%m%d%H%M%S", "%y%j%H%M%S", "%j%H%M%S"])
def test_digits_of_a_time_of_day_behind_those_of_a_date(make: Make, written: str) -> None:
    first = datetime.datetime(2023, 6, 14, 23, 57, 0)
    cells = [(first + datetime.timedelta(seconds=2 * k)).strftime(written) for k in range(150)]
    log = logs.read(make("Time,range_m,az_deg\n" + "".join(f"{cell},{900 + k},20\n" for k, cell in enumerate(cells))))
    np.testing.assert_allclose(log.time_s, 86220 + 2 * np.arange(150), atol=1e-6)
    assert "hhmmss behind a date" in log.understood["clock"]
