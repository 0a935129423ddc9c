"""Exports of instruments and decoders that nobody here wrote, as their makers describe the columns."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import clock, fixed, flight, lines

FLIGHT = flight()
R, A, E = FLIGHT.r, np.degrees(FLIGHT.a), np.degrees(FLIGHT.e)
CLOCK = clock(FLIGHT.moments())
HOURS = fixed(FLIGHT.sod() / 3600, 8)


@pytest.mark.parametrize(
    ("names", "columns", "mark"),
    [
        ("TIME(GMT);RANGE(YDS);AZIMUTH(DEG);ELEV(DEG)", (CLOCK, R / 0.9144, A, E), ";"),
        ("Время;Дальность, м;Азимут, т.д.;Угол места, т.д.", (CLOCK, R, A / 0.06, E / 0.06), ";"),
        ("Horodatage;Distance (m);Azimut (°);Site (°)", (CLOCK, R, A, E), ";"),
        ("Decimal time (hours),Azimuth (degrees),Elevation (degrees),Range (m)", (HOURS, A, E, R), ","),
        ("t[ms];dist[yd];azi[deg];ele[deg]", (1e3 * FLIGHT.t, R / 0.9144, A, E), ";"),
        ("utc,r_dst_nmi,r_dir_deg,elev_deg", (CLOCK, R / 1852, A, E), ","),
    ],
)
def test_an_export_is_read_at_once(make: Make, names: str, columns: tuple[np.ndarray, ...], mark: str) -> None:
    log = logs.read(make(lines(names, *columns, separator=mark)))
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=1e-3)
    np.testing.assert_allclose(log.measurement[:, 0], R, atol=0.01)
    np.testing.assert_allclose(log.measurement[:, 2], np.radians(E), atol=1e-5)
    turned = (log.measurement[:, 1] - FLIGHT.a + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(turned, 0, atol=1e-5)


def test_a_range_in_a_unit_of_time_is_a_time_of_flight(make: Make) -> None:
    light = 0.299792458  # m/ns
    for name, way in (("one_way_range_ns", 1), ("R_ns", 2)):
        path = make(lines(f"time_s,{name},az_deg,el_deg", FLIGHT.t, way * R / light, A, E))
        said = refused(path)
        assert f"Say --columns range={name} --units 'range={light / way:.9g} m'" in said
        log = logs.read(path, columns=f"range={name}", units=f"range={light / way:.9g} m")
        np.testing.assert_allclose(log.measurement[:, 0], R, atol=0.01)
