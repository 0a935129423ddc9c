"""Times that count days or parts of a day in one column, by names that are no usual ones of a time."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import fixed, flight, lines

FLIGHT = flight()
SECONDS = FLIGHT.sod()
COLUMNS = (fixed(FLIGHT.r, 3), fixed(np.degrees(FLIGHT.a), 6), fixed(np.degrees(FLIGHT.e), 6))
DAY_OF_YEAR, MJD, EXCEL = 152, 60461, 45443  # 2024-05-31


@pytest.mark.parametrize(
    ("name", "start", "in_a_day", "decimals"),
    [
        *((name, DAY_OF_YEAR, 1, 8) for name in ("DOY", "Day of year", "JDAY", "decimal day of year", "Time (DOY)")),
        *((name, DAY_OF_YEAR, 1, 8) for name in ("Fractional DOY", "Julian Day", "day", "DayOfYear (UTC)")),
        *((name, MJD, 1, 8) for name in ("MJD", "t_mjd", "Epoch (MJD)", "UTC MJD", "mjd_utc", "Time")),
        *((name, MJD + 2_400_000.5, 1, 9) for name in ("Time (JD)", "JD (UT)", "obs_jd")),
        *((name, EXCEL, 1, 9) for name in ("Excel Serial", "ole_date", "time_excel", "Date")),
        ("ms of day", 0, 86_400_000, 0),
        ("Minutes of day", 0, 1440, 7),
        ("Day fraction", 0, 1, 9),
    ],
)
def test_days_and_parts_of_days_are_read(
    make: Make, name: str, start: float, in_a_day: float, decimals: int
) -> None:  # fmt: skip
    times = fixed(start + SECONDS / 86_400 * in_a_day, decimals)
    log = logs.read(make(lines(f"{name},range_m,az_deg,el_deg", times, *COLUMNS)))
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=2e-3)
    np.testing.assert_allclose(log.time_s[0] % 86_400, SECONDS[0], atol=2e-3)
    np.testing.assert_allclose(log.measurement[:, 0], FLIGHT.r, atol=1e-3)
    assert log.epoch == ("2024-05-31T00:00:00Z" if start > DAY_OF_YEAR else "")


def test_a_day_of_the_year_beside_a_time_of_day_is_its_date(make: Make) -> None:
    days = np.full(len(SECONDS), DAY_OF_YEAR)
    log = logs.read(make(lines("DOY,Seconds of day,range_m,az_deg,el_deg", days, fixed(SECONDS, 3), *COLUMNS)))
    np.testing.assert_allclose(log.time_s % 86_400, SECONDS, atol=1e-3)


@pytest.mark.parametrize(
    ("name", "in_a_second"),
    [
        *((name, 1 / 60) for name in ("minutes", "Minutes since start", "decimal minutes", "minute")),
        *((name, 1e3) for name in ("milliseconds", "msec", "Millis", "millis()", "elapsed milliseconds")),
        *(("microseconds", 1e6), ("Time (tenths of a second)", 10), ("Time [hundredths of a second]", 100)),
        *(("t/0.1 s", 10), ("Time / 100 ms", 10)),
    ],
)
def test_a_unit_of_time_is_a_name_of_a_time(make: Make, name: str, in_a_second: float) -> None:
    times = fixed(FLIGHT.t * in_a_second, 7 if in_a_second < 1 else 0)
    log = logs.read(make(lines(f"{name},range_m,az_deg,el_deg", times, *COLUMNS)))
    steps = np.diff(log.time_s) - np.diff(np.array([float(t) for t in times.tolist()]) / in_a_second)
    np.testing.assert_allclose(steps, 0, atol=1e-6)
    assert not any("times" in each or "changes nothing" in each for each in log.understood["assumed"])


@pytest.mark.parametrize("name", ["min", "Max minutes", "minutes to go"])
def test_other_names_with_minutes_are_none(make: Make, name: str) -> None:
    path = make(lines(f"{name},range_m,az_deg,el_deg", fixed(FLIGHT.t / 60, 7), *COLUMNS))
    assert "no time column" in refused(path)


@pytest.mark.parametrize(("step", "in_a_second"), [("10", 0.1), ("1/10", 10)])
def test_a_bar_before_a_factor_is_read_by_the_motion(make: Make, step: str, in_a_second: float) -> None:
    """The title is that of multiples of 10 s, and some mean tenths of a second."""
    text = lines("t/10 s,range_m,az_deg,el_deg", fixed(FLIGHT.t * in_a_second, 3), *COLUMNS)
    log = logs.read(make(text)) if step == "10" else logs.read(make(text), columns="time=t/10 s", units="time=1/10 s")
    np.testing.assert_allclose(np.ptp(log.time_s), np.ptp(FLIGHT.t), rtol=1e-3)
    if step == "1/10":
        assert "Say --columns 'time=t/10 s' --units 'time=1/10 s'" in refused(make(text))
        assert refused(make(text), units="time=1/10 s").endswith("--columns 'time=t/10 s' --units 'time=1/10 s'.")
