"""Exports of instruments and decoders that nobody here wrote, as their makers describe the columns."""

import numpy as np
import pytest

from ftproc.files.reading import logs
from tests.files.conftest import Make, refused
from tests.files.zoo.flight import clock, fixed, flight, lines

FLIGHT = flight()
R, A, E = FLIGHT.r, np.degrees(FLIGHT.a), np.degrees(FLIGHT.e)
CLOCK = clock(FLIGHT.moments())
COUNTS = [np.round(angle / 360 * 2**20) % 2**20 for angle in (A, E)]
HOURS = fixed(FLIGHT.sod() / 3600, 8)


@pytest.mark.parametrize(
    ("names", "columns", "mark"),
    [
        ("TIME(GMT);RANGE(YDS);AZIMUTH(DEG);ELEV(DEG)", (CLOCK, R / 0.9144, A, E), ";"),
        ("Время;Дальность, м;Азимут, т.д.;Угол места, т.д.", (CLOCK, R, A / 0.06, E / 0.06), ";"),
        ("Horodatage;Distance (m);Azimut (°);Site (°)", (CLOCK, R, A, E), ";"),
        ("Decimal time (hours),Azimuth (degrees),Elevation (degrees),Range (m)", (HOURS, A, E, R), ","),
        ("t;Range (st. mi.);Az (20 bit);El (20-bit encoder counts)", (FLIGHT.t, R / 1609.344, *COUNTS), ";"),
        ("t;Range [statute miles];Azimuth counts (2^20 per turn);el_bam20", (FLIGHT.t, R / 1609.344, *COUNTS), ";"),
        (
            "t;Range (naut. mi.);Az [counts/rev=1048576];El [1048576 counts per revolution]",
            (FLIGHT.t, R / 1852, *COUNTS),
            ";",
        ),
        ("t[ms];dist[yd];azi[deg];ele[deg]", (1e3 * FLIGHT.t, R / 0.9144, A, E), ";"),
        ("utc,r_dst_nmi,r_dir_deg,elev_deg", (CLOCK, R / 1852, A, E), ","),
    ],
)
def test_an_export_is_read_at_once(make: Make, names: str, columns: tuple[np.ndarray, ...], mark: str) -> None:
    log = logs.read(make(lines(names, *columns, separator=mark)))
    np.testing.assert_allclose(log.time_s - log.time_s[0], FLIGHT.t, atol=1e-3)
    np.testing.assert_allclose(log.measurement[:, 0], R, atol=0.01)
    np.testing.assert_allclose(log.measurement[:, 2], np.radians(E), atol=1e-5)
    assert not any("changes nothing" in each for each in log.understood["assumed"])
    turned = (log.measurement[:, 1] - FLIGHT.a + np.pi) % (2 * np.pi) - np.pi
    np.testing.assert_allclose(turned, 0, atol=1e-5)


@pytest.mark.parametrize("bits", [12, 16, 20, 24, 31])
@pytest.mark.parametrize("names", ["az_counts,el_counts", "Azimuth enc,Elevation enc", "az encoder,el (deg)"])
def test_an_encoder_has_the_bits_at_which_it_turns(make: Make, bits: int, names: str) -> None:
    azimuth, elevation = np.radians(A) + 0.3 - np.radians(A[len(A) // 2]), FLIGHT.e - FLIGHT.e.max() - 0.01
    counts = [np.round(angle / (2 * np.pi) * 2**bits) % 2**bits for angle in (azimuth, elevation)]
    counts = [counts[0], np.degrees(elevation)] if "deg" in names else counts
    log = logs.read(make(lines(f"t,range_m,{names}", FLIGHT.t, R, *counts)))
    np.testing.assert_allclose(np.cos(log.measurement[:, 1] - azimuth), 1, atol=1e-5)
    np.testing.assert_allclose(log.measurement[:, 2], elevation, atol=2e-3)
    assert any(f"an encoder of {bits} bits" in remark for remark in log.remarks)


@pytest.mark.parametrize("wrong", ["no turn", "an outlier", "no whole numbers"])
def test_other_counts_are_asked_about(make: Make, wrong: str) -> None:
    azimuth = np.round(np.linspace(3000, 50, len(R)))
    azimuth[9] = 2**20 - 1 if wrong == "an outlier" else azimuth[9]
    azimuth[99:] = 2**20 - np.arange(1, len(R) - 98) * (1.5 if wrong == "no whole numbers" else 1)
    azimuth[99:] -= 2**18 if wrong == "no turn" else 2**20 - 50 if wrong == "an outlier" else 0
    path = make(lines("t,range_m,az_counts,el_counts", FLIGHT.t, R, azimuth, E))
    assert "Say --columns azimuth=az_counts --units 'azimuth=16 bit', or as many bits as it has" in refused(path)
    log = logs.read(path, columns="azimuth=az_counts,elevation=none", units="azimuth=20 bit")
    np.testing.assert_allclose(log.measurement[:9, 1], azimuth[:9] * 2 * np.pi / 2**20)


def test_a_range_in_a_unit_of_time_is_a_time_of_flight(make: Make) -> None:
    light = 0.299792458  # m/ns
    for name, way in (("one_way_range_ns", 1), ("R_ns", 2)):
        path = make(lines(f"time_s,{name},az_deg,el_deg", FLIGHT.t, way * R / light, A, E))
        said = refused(path)
        assert f"Say --columns range={name} --units 'range={light / way:.9g} m'" in said
        log = logs.read(path, columns=f"range={name}", units=f"range={light / way:.9g} m")
        np.testing.assert_allclose(log.measurement[:, 0], R, atol=0.01)
