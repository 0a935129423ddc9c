"""The letters of surveyors: H, V and S, of which none says what it is alone."""

from __future__ import annotations

import numpy as np
import pytest

from ftproc.files.reading import logs
from ftproc.settings import Station
from tests.files.conftest import Make, refused
from tests.files.reading.standards.test_layouts import DEG, A, E, R, T


def test_no_column_beside_v_is_left_out_without_a_question(make: Make) -> None:
    rows = zip(T, A * DEG, 90 - E * DEG, R, strict=True)
    path = make("t,H,V,S\n" + "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in rows))
    station, units = Station(elevation_from="zenith"), "elevation=deg"
    assert 'column "S" may be the range' in refused(path, station=station, units=units)
    assert "azimuth=H" in refused(path, station=station, units=units, columns="range=S")
    log = logs.read(path, station=station, units="azimuth=deg,elevation=deg", columns="range=S,azimuth=H")
    np.testing.assert_allclose(log.measurement, np.transpose([R, A, E]), rtol=0, atol=1e-5)


@pytest.mark.parametrize("unit", ["", " (deg)"])
@pytest.mark.parametrize(
    "name",
    ["z. d.", "Z.D.", "ZD", "Zen. Dist.", "distance zénithale", "Angle zénithal", "Distancia cenital", "ángulo cenital",
     "distanza zenitale", "angolo zenitale", "distância zenital", "odległość zenitalna", "Kąt zenitalny", "Zenithoek",
     "zenitavstånd", "зенитный угол", "天頂距"],
)  # fmt: skip
def test_a_zenith_angle_is_known_by_its_name(make: Make, name: str, unit: str) -> None:
    rows = (f"{t},{r:.3f},{a * DEG:.5f},{90 - e * DEG:.5f}\n" for t, r, a, e in zip(T, R, A, E, strict=True))
    log = logs.read(make(f"time_s,range_m,az_deg,{name}{unit}\n" + "".join(rows)))
    np.testing.assert_allclose(log.measurement[:, 2], E, atol=1e-6)
