"""Numbers in several columns side by side: degrees, minutes and seconds in any language, km and m."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.files.reading.meaning import carried
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_layouts import DEG, A, E, R, T

NAMES = {
    2: (
        "t,R,Az Grad,Az Min,El Grad,El Min",
        "Zeit;Entfernung;Azimut Grad;Azimut Minuten;Elevation Grad;Elevation Minuten",
        "Время;Дальность;Азимут град;Азимут мин;Угол места град;Угол места мин",
        "temps;distance;azimut degrés;azimut minutes;site degrés;site minutes",
        "tiempo,distancia,acimut grados,acimut minutos,elevacion grados,elevacion minutos",
        "时间,斜距,方位角度,方位角分,俯仰角度,俯仰角分",
        "t,range,AZ,,EL,",
        "t_s,range_m,azimuth,min,elevation,min",
        "t,range_m,AzD,AzM,ElD,ElM",
    ),
    3: (
        "Zeit,Entf.,Az [°],Az ['],Az [''],El [°],El ['],El ['']",
        "Время,Дальность,Азимут град,Азимут мин,Азимут сек,Угол места град,Угол места мин,Угол места сек",
        "t,range,AZ,,,EL,,",
        "t,range,Azimuth,min,sec,Elevation,min,sec",
        "t,range,Hz °,Hz ',Hz '',V °,V ',V ''",
    ),
}


def parts(angle: np.ndarray, count: int) -> list[np.ndarray]:
    """Whole numbers and what is left, `count` of them, of positive angles in rad."""
    found, rest = [], np.round(np.abs(angle) * DEG, 7)
    for _ in range(count - 1):
        found.append(np.floor(rest))
        rest = (rest - found[-1]) * 60
    return [*found, np.round(rest, 5)]


def rows(*columns: np.ndarray) -> str:
    return "".join(",".join(f"{v:.10g}" for v in row) + "\n" for row in zip(*columns, strict=True))


@pytest.mark.parametrize(("count", "names"), [(count, names) for count, each in NAMES.items() for names in each])
def test_degrees_minutes_and_seconds_in_columns_of_their_own(make: Make, count: int, names: str) -> None:
    body = rows(T, R, *parts(A % (2 * np.pi), count), *parts(E, count))
    log = logs.read(make(names.replace(";", ",") + "\n" + body))
    np.testing.assert_allclose(log.measurement, np.column_stack([R, A % (2 * np.pi), E]), atol=1e-4)


@pytest.mark.parametrize(
    "names", ["R_km,R_m", "range_km,range_m", "km,m", "rng km,m", "斜距km,斜距m", "Entf_km,Entf_m"]
)
def test_km_and_the_metres_beyond_are_one_range(make: Make, names: str) -> None:
    far = R + 20_000 + 45 * T
    log = logs.read(make(f"t_s,{names},az_deg,el_deg\n" + rows(T, far // 1000, far % 1000, A * DEG, E * DEG)))
    np.testing.assert_allclose(log.measurement[:, 0], far, rtol=1e-8)
    assert log.understood["columns"]["range"]["why"] == carried.WHY


def test_two_ranges_that_do_not_carry_over_are_asked_about(make: Make) -> None:
    head = "t_s,range_km,range_m,az_deg,el_deg\n"
    for km, m in ((R / 1000, R), (np.round(R / 1000), R), (R // 1000, R % 1000 // 2 + 0 * R + np.arange(len(R)) % 7)):
        assert "could each be the range" in refused(make(head + rows(T, km, m, A * DEG, E * DEG)))


def test_columns_of_one_name_are_proposed_by_their_numbers(make: Make) -> None:
    body = rows(T, R, *parts(A % (2 * np.pi), 3), *parts(E, 3))
    said = refused(make("t,r,D,M,S,D,M,S\n" + body))
    assert "--columns azimuth=3+4+5,elevation=6+7+8, which gives a target" in said
    log = logs.read(make("t,r,D,M,S,D,M,S\n" + body), columns="azimuth=3+4+5,elevation=6+7+8")
    np.testing.assert_allclose(log.measurement[:, 1], A % (2 * np.pi), atol=1e-4)


def test_the_elevation_is_written_as_the_azimuth(make: Make) -> None:
    level = np.radians(7.2 + 0.001 * T)  # no minute of which shows anything
    log = logs.read(make("t,range,AZ,,EL,\n" + rows(T, R, *parts(A % (2 * np.pi), 2), *parts(level, 2))))
    np.testing.assert_allclose(log.measurement[:, 2], level, atol=1e-6)


def test_a_minimum_beside_degrees_is_no_minutes(make: Make) -> None:
    azimuth = A * DEG % 360
    path = make("t_s,range_m,az_deg,az_min,el_deg\n" + rows(T, R, azimuth, azimuth - 1.5, E * DEG))
    assert '"az_deg" has decimals. Say --columns azimuth=az_deg if' in refused(path)
    np.testing.assert_allclose(np.degrees(logs.read(path, columns="azimuth=az_deg").measurement[:, 1]) % 360, azimuth)
    path = make("t_s,range_m,az_deg,az_min,el_deg\n" + rows(T, R, np.round(azimuth), azimuth - 190, E * DEG))
    assert '"az_min" is beyond 60' in refused(path)
